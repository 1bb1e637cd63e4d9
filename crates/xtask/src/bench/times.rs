//! Times out of what divan prints: a tree of benchmarks, a row each, and below a row how many items that is in a second.

use std::collections::BTreeMap;

/// What a benchmark took at best: other work on a machine makes it slower, and never faster.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Time {
    /// Seconds of one iteration.
    pub(crate) fastest_s: f64,
    /// Items in a second, where the benchmark counts them.
    pub(crate) items_per_s: Option<f64>,
}

/// The times of all benchmarks by the path of their names, `function/argument`.
pub(crate) fn times(printed: &str) -> BTreeMap<String, Time> {
    let mut times: BTreeMap<String, Time> = BTreeMap::new();
    let mut path: Vec<&str> = Vec::new();
    for line in printed.lines() {
        let row = line.trim_start_matches(['│', '├', '╰', '─', ' ']);
        let depth = line.chars().count() - row.chars().count();
        let (name, value) = name_and_value(row.split('│').next().unwrap_or_default());
        // Each level of the tree takes three columns; the first line is the program's.
        if depth == 0 {
            continue;
        }
        if !name.is_empty() {
            path.truncate(depth / 3 - 1);
            path.push(name);
        }
        let full = path.join("/");
        match value.map(|(number, unit)| (number, seconds(unit), per_second(unit))) {
            Some((number, Some(unit), _)) if !name.is_empty() => {
                times.insert(full, Time { fastest_s: number * unit, items_per_s: None });
            }
            Some((number, _, Some(unit))) => {
                times.entry(full).and_modify(|time| time.items_per_s = Some(number * unit));
            }
            _ => {}
        }
    }
    times
}

/// How many times faster one is than another: by items, where both count them.
pub(crate) fn ratio(ours: Time, other: Time) -> f64 {
    match (ours.items_per_s, other.items_per_s) {
        (Some(ours), Some(other)) => ours / other,
        _ => other.fastest_s / ours.fastest_s,
    }
}

/// A cell like `solve_plain   125.1 µs`, which may lack either part.
fn name_and_value(cell: &str) -> (&str, Option<(f64, &str)>) {
    let cell = cell.trim();
    let Some((before, unit)) = cell.rsplit_once(' ') else { return (cell, None) };
    let (name, number) = before.trim_end().rsplit_once(' ').unwrap_or(("", before.trim_end()));
    match number.parse() {
        Ok(number) => (name.trim_end(), Some((number, unit))),
        Err(_) => (cell, None),
    }
}

fn seconds(unit: &str) -> Option<f64> {
    let units = [("ps", 1e-12), ("ns", 1e-9), ("µs", 1e-6), ("ms", 1e-3), ("s", 1.0), ("m", 60.0)];
    units.into_iter().find_map(|(name, value)| (name == unit).then_some(value))
}

fn per_second(unit: &str) -> Option<f64> {
    let units = [("item/s", 1.0), ("Kitem/s", 1e3), ("Mitem/s", 1e6), ("Gitem/s", 1e9), ("Titem/s", 1e12)];
    units.into_iter().find_map(|(name, value)| (name == unit).then_some(value))
}

#[cfg(test)]
mod tests {
    use super::*;

    const PRINTED: &str = "\
Timer precision: 10 ns
ring                            fastest       │ slowest       │ median        │ mean          │ samples │ iters
├─ explicit_push                1.502 ms      │ 2.1 ms        │ 1.6 ms        │ 1.61 ms       │ 100     │ 100
├─ plain_loop                                 │               │               │               │         │
│  ├─ 16                        12.5 µs       │ 20 µs         │ 13 µs         │ 13.1 µs       │ 30      │ 30
│  │                            64 Mitem/s    │ 50 Mitem/s    │ 60 Mitem/s    │ 61 Mitem/s    │         │
│  ╰─ Bodies { a: 1 }           900.5 ns      │ 20 µs         │ 13 µs         │ 13.1 µs       │ 30      │ 30
╰─ vectors                                    │               │               │               │         │
   ╰─ 16                        2 s           │ 3 s           │ 2 s           │ 2 s           │ 30      │ 30
                                0.32 Gitem/s  │ 50 Mitem/s    │ 60 Mitem/s    │ 61 Mitem/s    │         │
";

    #[test]
    fn a_tree_of_benchmarks_is_read() {
        let times = times(PRINTED);
        let names: Vec<&str> = times.keys().map(String::as_str).collect();
        assert_eq!(names, ["explicit_push", "plain_loop/16", "plain_loop/Bodies { a: 1 }", "vectors/16"]);
        assert_eq!(times["explicit_push"], Time { fastest_s: 1.502 * 1e-3, items_per_s: None });
        assert_eq!(times["plain_loop/16"], Time { fastest_s: 12.5 * 1e-6, items_per_s: Some(64.0 * 1e6) });
        let nanoseconds = Time { fastest_s: 900.5 * 1e-9, items_per_s: None };
        assert_eq!(times["plain_loop/Bodies { a: 1 }"], nanoseconds);
    }

    #[test]
    fn items_count_where_both_have_them() {
        let times = times(PRINTED);
        let by_items = ratio(times["vectors/16"], times["plain_loop/16"]);
        assert!((by_items - 5.0).abs() < 1e-9, "{by_items}");
        let by_time = ratio(times["explicit_push"], times["vectors/16"]);
        assert!((by_time - 2.0 / 1.502e-3).abs() < 1e-9 * by_time, "{by_time}");
    }
}
