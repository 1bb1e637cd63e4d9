//! Keys of tables as names in print: symbols with an index in italics, units in parentheses.

/// Units that end a key, the longest first.
const UNITS: [(&str, &str); 12] = [
    ("_kg_per_s", "kg/s"),
    ("_n_per_m", "N/m"),
    ("_m_per_s", "m/s"),
    ("_kg", "kg"),
    ("_hz", "Hz"),
    ("_px", "px"),
    ("_rad", "rad"),
    ("_pa", "Pa"),
    ("_s", "s"),
    ("_m", "m"),
    ("_n", "N"),
    ("_j", "J"),
];

/// A key or name as it stands in print: `c_d, tracks` has an italic symbol, `velocity_m_per_s` becomes `velocity (m/s)`. A name
/// that already has mathematics stays as it is.
pub(crate) fn printed(name: &str) -> String {
    if name.contains('$') {
        return name.into();
    }
    let words: Vec<String> = name.split(' ').map(word).collect();
    words.join(" ")
}

fn word(word: &str) -> String {
    let (body, mark) = word.split_at(word.trim_end_matches([',', ';', ':', '.']).len());
    let letters: Vec<char> = body.chars().collect();
    if let [symbol, '_', index] = letters[..]
        && symbol.is_alphabetic()
        && index.is_alphanumeric()
    {
        return format!("${symbol}_{index}${mark}");
    }
    let unit = UNITS.iter().find_map(|(ending, unit)| Some((body.strip_suffix(ending)?, unit)));
    match unit {
        // `delta_0_m`, but not `c_s`: a key says more than a letter.
        Some((quantity, unit)) if quantity.len() > 1 => {
            format!("{} ({unit}){mark}", quantity.replace('_', " "))
        }
        _ => word.replace('_', " "),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_key_is_left_raw() {
        for (key, name) in [
            ("c_d, tracks", "$c_d$, tracks"),
            ("striker velocity, velocity_m_per_s", "striker velocity, velocity (m/s)"),
            ("share_of_critical", "share of critical"),
            ("offset at one stiffness", "offset at one stiffness"),
            ("peak_time_s:", "peak time (s):"),
            ("$u_n$ of view_2", "$u_n$ of view_2"),
            ("view_2", "view 2"),
        ] {
            assert_eq!(printed(key), name);
        }
    }
}
