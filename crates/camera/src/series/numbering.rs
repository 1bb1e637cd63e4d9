//! The order of a series of images, and when each was taken, from the numbers in their names.

use std::collections::BTreeMap;

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

/// A name whose runs of digits are taken out.
struct Name {
    /// What is left, [`NUMBER`] in the place of each number.
    pattern: String,
    numbers: Vec<u64>,
}

impl Name {
    fn of(text: &str) -> Self {
        let mut name = Self { pattern: String::new(), numbers: Vec::new() };
        let mut digits = String::new();
        for letter in text.chars().chain(['\0']) {
            if letter.is_ascii_digit() {
                digits.push(letter);
                continue;
            }
            // Numbers too large for 64 bits are part of the name like letters.
            match digits.parse() {
                Ok(number) => {
                    name.pattern.push(NUMBER);
                    name.numbers.push(number);
                }
                Err(_) => name.pattern.push_str(&digits),
            }
            digits.clear();
            name.pattern.push(letter);
        }
        name.pattern.pop();
        name
    }
}

/// Stands for a number in a pattern: no letter of a file's name.
const NUMBER: char = '\0';

/// An image's place in the given list, and the numbers in its name.
type Member = (usize, Vec<u64>);

/// What a folder holds that no series can be made of, and what to do about it.
type Refusal = (String, String);

impl Numbering {
    /// The numbering of one image.
    pub(super) fn single() -> Self {
        Self { order: vec![0], spacing: 1, steps: vec![0], first: 0, warnings: Vec::new() }
    }

    /// The order of the images that make a series: those of the kind and the name, but for numbers, that most have.
    pub(super) fn of<K: Ord + Copy>(images: &[(K, &str)]) -> Result<Self, Refusal> {
        let mut groups: BTreeMap<(K, String), Vec<Member>> = BTreeMap::new();
        for (place, (kind, text)) in images.iter().enumerate() {
            let name = Name::of(text);
            groups.entry((*kind, name.pattern)).or_default().push((place, name.numbers));
        }
        let shown = |pattern: &str| pattern.replace(NUMBER, "*");
        let patterns: Vec<String> =
            groups.keys().map(|(_, pattern)| format!("`{}`", shown(pattern))).collect();
        let n_groups = groups.len();
        let Some(((_, pattern), series)) = groups.into_iter().max_by_key(|(_, members)| members.len()) else {
            return Err((
                "a folder without images".into(),
                "a folder of TIFF, PNG, BMP, JPEG or PGM images, or the path of a recording, is expected"
                    .into(),
            ));
        };
        let n_others = images.len() - series.len();
        if n_others >= series.len() {
            return Err((
                format!("a folder of {n_groups} series of images ({})", patterns.join(", ")),
                "give each series a folder of its own".into(),
            ));
        }
        let pattern = shown(&pattern);
        let mut numbering = Self::of_series(&pattern, series)?;
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

    fn of_series(pattern: &str, mut series: Vec<Member>) -> Result<Self, Refusal> {
        let n_columns = series.first().map_or(0, |(_, numbers)| numbers.len());
        let varies =
            |column: &usize| series.iter().any(|(_, numbers)| numbers[*column] != series[0].1[*column]);
        // The last number that varies counts the frames; what varies before it may be a date.
        let Some(column) = (0..n_columns).rev().find(varies) else {
            // One image, or names that differ only in how a number is written.
            return if series.len() == 1 { Ok(Self::single_at(series[0].0)) } else { Err(repeated(pattern)) };
        };
        series.sort_by_key(|(place, numbers)| (numbers[column], *place));
        let numbers: Vec<u64> = series.iter().map(|(_, numbers)| numbers[column]).collect();
        if numbers.windows(2).any(|pair| pair[0] == pair[1]) {
            return Err(repeated(pattern));
        }
        let spacing =
            numbers.iter().fold(0, |divisor, number| greatest_divisor(number - numbers[0], divisor));
        let steps = numbers.iter().map(|number| (number - numbers[0]) / spacing).collect();
        Ok(Self {
            order: series.iter().map(|(place, _)| *place).collect(),
            spacing,
            steps,
            first: i64::try_from(numbers[0]).unwrap_or(0),
            warnings: gaps(&numbers, spacing),
        })
    }

    fn single_at(place: usize) -> Self {
        Self { order: vec![place], ..Self::single() }
    }
}

fn repeated(pattern: &str) -> Refusal {
    (
        format!("a folder in which images `{pattern}` have the same last number"),
        "give each series a folder of its own".into(),
    )
}

fn greatest_divisor(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { greatest_divisor(b, a % b) }
}

/// What is odd about increasing numbers that are `spacing`, their greatest common spacing, or multiples of it apart.
fn gaps(numbers: &[u64], spacing: u64) -> Vec<String> {
    const N_NAMED: usize = 5;
    let wide = numbers.windows(2).filter(|pair| pair[1] - pair[0] > spacing);
    let missing: Vec<String> = wide
        .clone()
        .map(|pair| (pair[0] + spacing, pair[1] - spacing))
        .map(|(from, to)| if from == to { from.to_string() } else { format!("{from} to {to}") })
        .collect();
    let n_missing: u64 = wide.map(|pair| (pair[1] - pair[0]) / spacing - 1).sum();
    let mut warnings = Vec::new();
    if spacing > 1 {
        warnings.push(format!("the images' numbers advance by {spacing}: one interval is taken to be that"));
    }
    if n_missing > 0 {
        let named = missing[..missing.len().min(N_NAMED)].join(", ");
        let more = if missing.len() > N_NAMED { ", and more" } else { "" };
        warnings.push(format!(
            "{n_missing} images are missing between others: {named}{more}; times keep their place"
        ));
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
