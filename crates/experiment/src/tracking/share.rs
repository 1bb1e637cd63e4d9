//! The part of an experiment that one of several machines tracks.

use std::str::FromStr;

/// The part of an experiment's recordings that one of several machines tracks: every `of`-th one, from the `number`-th on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Share {
    /// From 1.
    number: usize,
    of: usize,
}

impl Share {
    /// The items of this share, in their order.
    pub(crate) fn of<T: Clone>(self, items: &[T]) -> Vec<T> {
        items.iter().skip(self.number - 1).step_by(self.of).cloned().collect()
    }
}

impl FromStr for Share {
    type Err = String;

    /// Reads `K/N`, such as `2/8`.
    fn from_str(text: &str) -> Result<Self, String> {
        let number = |part: &str| part.trim().parse::<usize>().ok();
        text.split_once('/')
            .and_then(|(k, n)| Some(Self { number: number(k)?, of: number(n)? }))
            .filter(|share| (1..=share.of).contains(&share.number))
            .ok_or_else(|| format!("expected K/N with K from 1 to N, such as 2/8, found {text:?}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_hold_every_item_once() {
        let items: Vec<u32> = (0..10).collect();
        for n in 1..13 {
            let mut all: Vec<u32> =
                (1..=n).flat_map(|k| format!("{k}/{n}").parse::<Share>().unwrap().of(&items)).collect();
            all.sort_unstable();
            assert_eq!(all, items);
        }
    }

    #[test]
    fn what_is_no_share_is_refused() {
        for text in ["", "3", "0/4", "5/4", "1/0", "a/b", "1/2/3", "-1/4"] {
            assert!(text.parse::<Share>().unwrap_err().contains("K/N"), "{text}");
        }
    }
}
