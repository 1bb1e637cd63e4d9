//! The order of a series of images, and when each was taken, from the numbers in their names.

mod counter;
mod name;

use counter::{Order, sort};
use name::{Groups, Member, Name, Pattern, join_signed};

use crate::name_list::first_names;

/// Names of images in their order, and what the numbers in them say.
#[derive(Debug, PartialEq)]
pub(super) struct Numbering {
    /// Places of the images in the given list, frame by frame.
    pub(super) order: Vec<usize>,
    /// What the numbers advance by, taken for one interval.
    pub(super) spacing: u64,
    /// How many intervals after the first frame each frame was taken.
    pub(super) steps: Vec<u64>,
    /// Number of the first frame.
    pub(super) first: i64,
    pub(super) warnings: Vec<String>,
}

/// What a folder holds that no series can be made of, and what to do about it.
type Refusal = (String, String);

impl Numbering {
    /// The numbering of one image.
    pub(super) fn single() -> Self {
        Self { order: vec![0], spacing: 1, steps: vec![0], first: 0, warnings: Vec::new() }
    }

    /// The order of the images that make a series: those of the kind and the name, but for numbers, that most have.
    pub(super) fn of<K: Ord + Copy>(images: &[(K, &str)]) -> Result<Self, Refusal> {
        let mut groups: Groups<K> = Groups::new();
        for (place, (kind, text)) in images.iter().enumerate() {
            let name = Name::of(text);
            groups.entry((*kind, name.pattern)).or_default().push((place, name.numbers));
        }
        let signs = join_signed(&mut groups);
        let patterns: Vec<String> =
            groups.keys().map(|(_, pattern)| format!("`{}`", pattern.shown())).collect();
        let n_groups = groups.len();
        let Some(((_, pattern), series)) = groups.into_iter().max_by_key(|(_, members)| members.len()) else {
            return Err((
                "a folder without images".into(),
                "give a folder of TIFF, PNG, BMP, JPEG or PGM images, or the path of a recording".into(),
            ));
        };
        let n_others = images.len() - series.len();
        if n_others >= series.len() {
            return Err((
                format!("a folder of {n_groups} series of images ({})", patterns.join(", ")),
                "give each series a folder of its own".into(),
            ));
        }
        let mut numbering = Self::of_series(&pattern, series)?;
        numbering.warnings.extend(signs);
        let pattern = pattern.shown();
        if n_others > 0 {
            let others: Vec<&String> =
                patterns.iter().filter(|other| **other != format!("`{pattern}`")).collect();
            let named = others.first().map_or("", |other| other.as_str());
            numbering.warnings.push(format!(
                "{n_others} images are left out whose names are not like `{pattern}`, such as {named}"
            ));
        }
        Ok(numbering)
    }

    fn of_series(pattern: &Pattern, mut series: Vec<Member>) -> Result<Self, Refusal> {
        if let [(place, _)] = series[..] {
            return Ok(Self { order: vec![place], ..Self::single() });
        }
        match sort(pattern, &mut series) {
            Order::Counted { column, warning } => Ok(Self::counted(&series, column, warning)),
            Order::Uncounted { warning } => Ok(Self {
                order: series.iter().map(|(place, _)| *place).collect(),
                steps: (0..series.len() as u64).collect(),
                warnings: vec![warning],
                ..Self::single()
            }),
            Order::Repeated => Err(repeated(&pattern.shown())),
        }
    }

    /// Of a series in the order of the numbers of a column, which differ.
    fn counted(series: &[Member], column: usize, warning: Option<String>) -> Self {
        let numbers: Vec<i128> = series.iter().map(|(_, numbers)| numbers[column].value).collect();
        let spacing =
            numbers.iter().fold(0, |divisor, number| greatest_divisor(number - numbers[0], divisor));
        let steps = numbers.iter().map(|number| saturated((number - numbers[0]) / spacing)).collect();
        Self {
            order: series.iter().map(|(place, _)| *place).collect(),
            spacing: saturated(spacing),
            steps,
            first: i64::try_from(numbers[0]).unwrap_or(0),
            warnings: warning.into_iter().chain(gaps(&numbers, spacing)).collect(),
        }
    }
}

fn repeated(pattern: &str) -> Refusal {
    (
        format!("a folder in which images `{pattern}` have the same last number"),
        "give each series a folder of its own".into(),
    )
}

/// A count that is not negative.
fn saturated(n: i128) -> u64 {
    u64::try_from(n).unwrap_or(u64::MAX)
}

fn greatest_divisor(a: i128, b: i128) -> i128 {
    if b == 0 { a } else { greatest_divisor(b, a % b) }
}

/// What is odd about increasing numbers that are `spacing`, their greatest common spacing, or multiples of it apart.
fn gaps(numbers: &[i128], spacing: i128) -> Vec<String> {
    let wide = numbers.windows(2).filter(|pair| pair[1] - pair[0] > spacing);
    let missing: Vec<String> = wide
        .clone()
        .map(|pair| (pair[0] + spacing, pair[1] - spacing))
        .map(|(from, to)| if from == to { from.to_string() } else { format!("{from} to {to}") })
        .collect();
    let n_missing: i128 = wide.map(|pair| (pair[1] - pair[0]) / spacing - 1).sum();
    let mut warnings = Vec::new();
    if spacing > 1 {
        warnings.push(format!("the images' numbers advance by {spacing}: one interval is taken to be that"));
    }
    if n_missing > 0 {
        let named = first_names(&missing);
        warnings
            .push(format!("{n_missing} images are missing between others: {named}; times keep their place"));
    }
    warnings
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(names: &[&str]) -> Result<Numbering, Refusal> {
        let images: Vec<((), &str)> = names.iter().map(|name| ((), *name)).collect();
        Numbering::of(&images)
    }

    #[test]
    fn numbers_count_whatever_their_digits() {
        let numbering = of(&["shot10.png", "shot9.png", "shot100.png", "shot11.png"]).unwrap();
        assert_eq!((numbering.order, numbering.first), (vec![1, 0, 3, 2], 9));
        assert_eq!(numbering.steps, [0, 1, 2, 91]);
        assert_eq!(
            numbering.warnings,
            ["88 images are missing between others: 12 to 99; times keep their place"]
        );
    }

    #[test]
    fn a_star_in_a_name_is_a_letter() {
        assert_eq!(of(&["*1_2.tif", "*1_3.tif", "1*_7.tif"]).unwrap().order, [0, 1]);
        assert!(of(&["*1_2.tif", "1*_7.tif"]).is_err(), "two series of one image each");
    }

    #[test]
    fn the_last_number_that_varies_counts() {
        let names = ["2024-01-02_cam1_0001_v2.tif", "2024-01-03_cam1_0002_v2.tif"];
        let numbering = of(&names).unwrap();
        assert_eq!((numbering.order, numbering.first, numbering.warnings), (vec![0, 1], 1, vec![]));
    }

    #[test]
    fn a_common_spacing_is_one_interval() {
        let numbering = of(&["a1.tif", "a21.tif", "a41.tif", "a101.tif"]).unwrap();
        assert_eq!(numbering.steps, [0, 1, 2, 5]);
        assert!(numbering.warnings[0].contains("advance by 20"));
        assert!(numbering.warnings[1].contains("2 images are missing between others: 61 to 81"));
    }

    #[test]
    fn a_minus_before_numbers_that_others_have_without_one_is_a_sign() {
        let names = ["img_-00001.tif", "img_-00002.tif", "img_-00003.tif", "img_00000.tif", "img_00001.tif"];
        let numbering = of(&names).unwrap();
        assert_eq!((numbering.order, numbering.first), (vec![2, 1, 0, 3, 4], -3));
        assert_eq!(numbering.steps, [0, 1, 2, 3, 4]);
        assert_eq!(
            numbering.warnings,
            [
                "3 images are named `img_-*.tif` and others `img_*.tif`: the minus is taken for the sign of the number"
            ]
        );
        // A date before them, whose minuses separate.
        let dated = of(&["1-2-3_a-2.tif", "1-2-3_a-1.tif", "1-2-3_a0.tif"]).unwrap();
        assert_eq!((dated.order, dated.first), (vec![0, 1, 2], -2));
        let apart = of(&["img-00001.tif", "img-00002.tif", "img-00003.tif"]).unwrap();
        assert_eq!((apart.order, apart.first, apart.warnings), (vec![0, 1, 2], 1, vec![]));
        assert!(of(&["a-0.tif", "a0.tif"]).is_err());
    }

    #[test]
    fn times_of_day_are_in_order_across_their_seconds() {
        let names =
            ["c_20240101_120001_020000.tif", "c_20240101_120000_960000.tif", "c_20240101_120000_990000.tif"];
        let numbering = of(&names).unwrap();
        assert_eq!((numbering.order, numbering.steps, numbering.first), (vec![1, 2, 0], vec![0, 1, 2], 0));
        assert_eq!(numbering.spacing, 1);
        assert!(numbering.warnings[0].contains("no number in the names `c_*_*_*.tif` counts the images"));
    }

    #[test]
    fn a_number_that_goes_up_by_one_counts_whatever_stands_behind_or_before_it() {
        let exposures = of(&["f_0001_exp037.tif", "f_0000_exp000.tif", "f_0002_exp012.tif"]).unwrap();
        assert_eq!((exposures.order, exposures.first, exposures.warnings), (vec![1, 0, 2], 0, vec![]));
        let same = of(&["f_0001_exp037.tif", "f_0000_exp000.tif", "f_0002_exp037.tif"]).unwrap();
        assert_eq!((same.order, same.warnings), (vec![1, 0, 2], vec![]));
        // Over midnight.
        let numbering = of(&["235959_0007.tif", "000000_0008.tif", "000001_0009.tif"]).unwrap();
        assert_eq!((numbering.order, numbering.first), (vec![0, 1, 2], 7));
        assert!(numbering.warnings[0].contains("number 2 in their names"), "{:?}", numbering.warnings);
        let warm = of(&["T37_f1.tif", "T12_f2.tif", "T40_f4.tif", "T39_f5.tif"]).unwrap();
        assert_eq!((warm.order, warm.steps), (vec![0, 1, 2, 3], vec![0, 1, 3, 4]));
        assert!(warm.warnings[0].contains("number 2 in their names"), "{:?}", warm.warnings);
        // With a gap: the one of the narrower span.
        let gap = of(&["f_0001_exp037.tif", "f_0000_exp000.tif", "f_0003_exp090.tif"]).unwrap();
        assert_eq!((gap.order, gap.first, gap.steps), (vec![1, 0, 2], 0, vec![0, 1, 3]));
    }

    #[test]
    fn digits_behind_a_point_are_fractions() {
        let numbering = of(&["t0.5.tif", "t0.25.tif", "t10.125.tif", "t0.75.tif", "t1.0.tif"]).unwrap();
        assert_eq!((numbering.order, numbering.first), (vec![1, 0, 3, 4, 2], 0));
        assert!(numbering.warnings[0].contains("no number in the names"), "{:?}", numbering.warnings);
        assert_eq!(of(&["t0.5.tif", "t0.05.tif"]).unwrap().order, [1, 0]);
        let halves = of(&["t0.5.tif", "t0.25.tif"]).unwrap();
        assert_eq!((halves.order, halves.steps), (vec![1, 0], vec![0, 1]));
        // Of one length they can be counted by; and a second counter is none.
        assert_eq!(of(&["t0.002.tif", "t0.001.tif"]).unwrap().order, [1, 0]);
        let counted = of(&["v1.9.tif", "v1.10.tif", "v1.11.tif"]).unwrap();
        assert_eq!((counted.order, counted.first, counted.warnings), (vec![0, 1, 2], 9, vec![]));
        assert_eq!(of(&["2024.1.19.tif", "2024.1.9.tif"]).unwrap().order, [1, 0]);
    }

    #[test]
    fn other_images_are_left_out_and_named() {
        let numbering = of(&["def_1.tif", "def_2.tif", "ref.tif"]).unwrap();
        assert_eq!(numbering.order, [0, 1]);
        assert_eq!(
            numbering.warnings,
            ["1 images are left out whose names are not like `def_*.tif`, such as `ref.tif`"]
        );
    }

    #[test]
    fn several_series_in_one_folder_are_refused() {
        let cameras = of(&["cam1_1.tif", "cam1_2.tif", "cam2_1.tif", "cam2_2.tif"]).unwrap_err();
        assert!(cameras.0.contains("same last number"), "{cameras:?}");
        let names = of(&["left_1.tif", "left_2.tif", "right_1.tif", "right_2.tif"]).unwrap_err();
        assert!(names.0.contains("2 series") && names.0.contains("`right_*.tif`"), "{names:?}");
        assert!(of(&["1.tif", "01.tif"]).unwrap_err().0.contains("same last number"));
        assert!(of(&[]).unwrap_err().0.contains("without images"));
    }

    #[test]
    fn numbers_beyond_all_bounds_are_letters() {
        let long = "9".repeat(40);
        let names = [format!("{long}_2.png"), format!("{long}_1.png")];
        assert_eq!(of(&[&names[0], &names[1]]).unwrap().order, [1, 0]);
        let numbering = of(&["0.png", "18446744073709551615.png"]).unwrap();
        assert_eq!(numbering.steps, [0, 1]);
    }
}
