//! Colours: one for each model in all figures, maps in equal steps, and shades that also differ in grey.

/// A colour on the screen (sRGB, 8 bit).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Rgb(pub(crate) u8, pub(crate) u8, pub(crate) u8);

pub(crate) const BLACK: Rgb = Rgb(0, 0, 0);
pub(crate) const WHITE: Rgb = Rgb(255, 255, 255);
/// Reference lines.
pub(crate) const GRAY: Rgb = Rgb(110, 110, 110);
/// Ground of cells that were not measured, and the hatching on it.
pub(crate) const BLANK: Rgb = WHITE;
pub(crate) const HATCH: Rgb = Rgb(150, 150, 150);

// What is measured and the two models: colour-blind readers tell them apart, and so do their grey values (see the test).
pub(crate) const EXPERIMENT: Rgb = Rgb(0, 68, 136);
pub(crate) const RINGS: Rgb = Rgb(204, 62, 62);
pub(crate) const CHAIN: Rgb = Rgb(226, 152, 0);
/// Series that are none of these, in turn.
pub(crate) const OTHERS: [Rgb; 4] = [BLACK, Rgb(0, 133, 100), Rgb(140, 70, 150), Rgb(90, 170, 215)];
/// The wave's front, as a ground.
pub(crate) const FRONT: Rgb = Rgb(200, 232, 205);
/// Shares of the energy: damping, and dispersion with rarefaction.
pub(crate) const DAMPING: Rgb = Rgb(120, 205, 220);
pub(crate) const DISPERSION: Rgb = Rgb(45, 100, 170);

impl Rgb {
    /// The colour mixed with white: `share` 1 is the colour itself, 0 is white.
    pub(crate) fn tint(self, share: f64) -> Self {
        self.mixed(WHITE, share)
    }

    /// The colour mixed with another: `share` 1 is the colour itself.
    fn mixed(self, other: Self, share: f64) -> Self {
        let mix = |own: u8, of: u8| (f64::from(of) + share * (f64::from(own) - f64::from(of))).round() as u8;
        Self(mix(self.0, other.0), mix(self.1, other.1), mix(self.2, other.2))
    }

    /// The colour as one of `count` in order, dark to light, none too light for a white page.
    pub(crate) fn shade(self, index: usize, count: usize) -> Self {
        let place = index as f64 / (count.max(2) - 1) as f64;
        if place < 0.5 { self.mixed(BLACK, 0.45 + 1.1 * place) } else { self.tint(1.0 - 0.8 * (place - 0.5)) }
    }
}

/// Sixteen equally spaced colours of viridis (Smith and van der Walt, matplotlib, CC0).
const VIRIDIS: [Rgb; 16] = [
    Rgb(0x44, 0x01, 0x54),
    Rgb(0x48, 0x1a, 0x6c),
    Rgb(0x47, 0x2f, 0x7d),
    Rgb(0x41, 0x44, 0x87),
    Rgb(0x39, 0x56, 0x8c),
    Rgb(0x31, 0x68, 0x8e),
    Rgb(0x2a, 0x78, 0x8e),
    Rgb(0x23, 0x88, 0x8e),
    Rgb(0x1f, 0x98, 0x8b),
    Rgb(0x22, 0xa8, 0x84),
    Rgb(0x35, 0xb7, 0x79),
    Rgb(0x54, 0xc5, 0x68),
    Rgb(0x7a, 0xd1, 0x51),
    Rgb(0xa5, 0xdb, 0x36),
    Rgb(0xd2, 0xe2, 0x1b),
    Rgb(0xfd, 0xe7, 0x25),
];

/// Viridis, dark to light, for `share` from 0 to 1 (clamped).
pub(crate) fn viridis(share: f64) -> Rgb {
    let place = share.clamp(0.0, 1.0) * (VIRIDIS.len() - 1) as f64;
    let below = (place.floor() as usize).min(VIRIDIS.len() - 2);
    let fraction = place - below as f64;
    let (from, to) = (VIRIDIS[below], VIRIDIS[below + 1]);
    let mix = |a: u8, b: u8| (f64::from(a) + fraction * (f64::from(b) - f64::from(a))).round() as u8;
    Rgb(mix(from.0, to.0), mix(from.1, to.1), mix(from.2, to.2))
}

/// Gray from black to nearly white in equal steps of lightness, for `share` from 0 to 1 (clamped).
pub(crate) fn gray(share: f64) -> Rgb {
    from_oklab(0.1 + 0.85 * share.clamp(0.0, 1.0), 0.0, 0.0)
}

/// The diverging colour map: blue for 0, nearly white for 0.5, red for 1 (clamped).
///
/// Built in the `OKLab` space (Ottosson 2020): lightness falls linearly and equally to both sides, the hue of each side is
/// constant, so equal steps look equal and the sign is told by hue alone.
pub(crate) fn diverging(share: f64) -> Rgb {
    let side = 2.0 * share.clamp(0.0, 1.0) - 1.0;
    let strength = side.abs();
    let hue = if side < 0.0 { 255.0_f64 } else { 35.0_f64 }.to_radians();
    // The chroma rises fast, so that small values already show their sign, and stays inside the screen's gamut.
    let chroma = 0.145 * (1.0 - (1.0 - strength).powi(2)) * (1.0 - 0.22 * strength);
    from_oklab(0.97 - 0.57 * strength, chroma * hue.cos(), chroma * hue.sin())
}

/// `OKLab` to sRGB, clipped to the gamut.
fn from_oklab(lightness: f64, green_red: f64, blue_yellow: f64) -> Rgb {
    let cone = |a: f64, b: f64| (lightness + a * green_red + b * blue_yellow).powi(3);
    let long = cone(0.396_337_777_4, 0.215_803_757_3);
    let medium = cone(-0.105_561_345_8, -0.063_854_172_8);
    let short = cone(-0.089_484_177_5, -1.291_485_548);
    Rgb(
        encode(4.076_741_662_1 * long - 3.307_711_591_3 * medium + 0.230_969_929_2 * short),
        encode(-1.268_438_004_6 * long + 2.609_757_401_1 * medium - 0.341_319_396_5 * short),
        encode(-0.004_196_086_3 * long - 0.703_418_614_7 * medium + 1.707_614_701 * short),
    )
}

/// The sRGB transfer function.
fn encode(linear: f64) -> u8 {
    let light = linear.clamp(0.0, 1.0);
    let coded = if light <= 0.003_130_8 { 12.92 * light } else { 1.055 * light.powf(1.0 / 2.4) - 0.055 };
    (255.0 * coded).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    /// CIE lightness L*, from 0 to 100.
    fn lightness(Rgb(r, g, b): Rgb) -> f64 {
        let linear = |channel: u8| {
            let coded = f64::from(channel) / 255.0;
            if coded <= 0.04045 { coded / 12.92 } else { ((coded + 0.055) / 1.055).powf(2.4) }
        };
        let luminance = 0.2126 * linear(r) + 0.7152 * linear(g) + 0.0722 * linear(b);
        if luminance > 0.008_856 { 116.0 * luminance.cbrt() - 16.0 } else { 903.3 * luminance }
    }

    #[test]
    fn the_sequential_map_rises_in_lightness_in_equal_steps() {
        let steps: Vec<f64> = (0..=32).map(|i| lightness(viridis(f64::from(i) / 32.0))).collect();
        let rises: Vec<f64> = steps.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let mean = rises.iter().sum::<f64>() / rises.len() as f64;
        // Viridis was built for equal steps in CAM02-UCS; in L* they agree within about a third, and 8-bit colours
        // add half a unit.
        assert!(rises.iter().all(|rise| (rise - mean).abs() < 0.4 * mean + 0.5), "{rises:?}");
    }

    #[test]
    fn the_diverging_map_falls_in_lightness_equally_to_both_sides() {
        for i in 1..=32 {
            let strength = f64::from(i) / 32.0;
            let (inner, outer) = (0.5 + 0.5 * (strength - 1.0 / 32.0), 0.5 + 0.5 * strength);
            assert!(lightness(diverging(outer)) < lightness(diverging(inner)));
            assert!(lightness(diverging(1.0 - outer)) < lightness(diverging(1.0 - inner)));
            // OKLab's lightness and L* differ by hue: up to about 5 units for these two hues.
            let imbalance = lightness(diverging(outer)) - lightness(diverging(1.0 - outer));
            assert!(imbalance.abs() < 6.0, "{strength}: {imbalance}");
        }
    }

    #[test]
    fn experiment_and_models_differ_in_gray() {
        let mut values = [EXPERIMENT, RINGS, CHAIN].map(lightness);
        values.sort_by(f64::total_cmp);
        // Ten units of L* are told apart at a glance by lines of a point's width (a page has a hundred); the lightest must stand
        // out from white as well.
        assert!(values.windows(2).all(|pair| pair[1] - pair[0] > 15.0), "{values:?}");
        assert!(values[2] < 75.0, "{values:?}");
        for count in 2..=9 {
            let shades: Vec<f64> = (0..count).map(|i| lightness(RINGS.shade(i, count))).collect();
            assert!(shades.windows(2).all(|pair| pair[0] < pair[1]), "{shades:?}");
        }
    }

    #[test]
    fn the_gray_map_has_no_hue_and_rises_evenly() {
        let steps: Vec<Rgb> = (0..=16).map(|i| gray(f64::from(i) / 16.0)).collect();
        // The channels of a neutral colour agree to one step of 8 bits.
        assert!(steps.iter().all(|Rgb(r, g, b)| r.abs_diff(*g) <= 1 && g.abs_diff(*b) <= 1), "{steps:?}");
        assert!(steps.windows(2).all(|pair| lightness(pair[0]) < lightness(pair[1])));
    }

    #[test]
    fn shares_outside_the_map_are_clamped_and_white_is_neutral() {
        assert_eq!(viridis(-1.0), viridis(0.0));
        assert_eq!(viridis(7.0), viridis(1.0));
        let Rgb(r, g, b) = diverging(0.5);
        assert!(r == g && g == b && r > 240);
        assert_eq!(RINGS.tint(0.0), WHITE);
        assert_eq!(RINGS.tint(1.0), RINGS);
    }
}
