//! The colours: series for every eye, scales for maps.

use plotters::style::RGBColor;
use schemars::JsonSchema;
use serde::Deserialize;

/// A colour of a picture.
pub(super) type Colour = RGBColor;

/// Ground of everything.
pub(super) const WHITE: Colour = RGBColor(255, 255, 255);
/// Text.
pub(super) const INK: Colour = RGBColor(0x1c, 0x20, 0x24);
/// Axes, remarks.
pub(super) const MUTED: Colour = RGBColor(0x5c, 0x64, 0x6d);
/// Lines of the grid at labelled ticks.
pub(super) const GRID: Colour = RGBColor(0xdd, 0xe1, 0xe5);
/// Lines of the grid between them.
pub(super) const FINE_GRID: Colour = RGBColor(0xef, 0xf1, 0xf3);
/// Limits; also what breaks one.
pub(super) const LIMIT: Colour = RGBColor(0xb3, 0x20, 0x1a);
/// Cells and bars without a value.
pub(super) const NO_VALUE: Colour = RGBColor(0xe4, 0xe7, 0xea);

/// Okabe and Ito's colours without yellow, which white ground swallows; those
/// with a contrast of 3 to 1 against white come first.
pub(super) const SERIES: [Colour; 7] = [
    RGBColor(0x00, 0x72, 0xb2),
    RGBColor(0xd5, 0x5e, 0x00),
    RGBColor(0x00, 0x9e, 0x73),
    RGBColor(0xcc, 0x79, 0xa7),
    RGBColor(0x00, 0x00, 0x00),
    RGBColor(0xe6, 0x9f, 0x00),
    RGBColor(0x56, 0xb4, 0xe9),
];

/// Blue and vermillion: what keeps a limit and what does not.
pub(super) const PASS: Colour = SERIES[0];
/// See [`PASS`].
pub(super) const FAIL: Colour = SERIES[1];

/// More ordered series than this take their colours from a scale, in order.
const MOST_NAMED: usize = 5;

/// The part of viridis that is dark enough for lines on white.
const DARK_PART: f64 = 0.72;

/// Colour of a series among `count`; `ordered` where the series are numbers.
pub(super) fn series(index: usize, count: usize, ordered: bool) -> Colour {
    if ordered && count > MOST_NAMED {
        let last = count.saturating_sub(1).max(1);
        return ColourScale::Viridis.at(DARK_PART * index as f64 / last as f64);
    }
    SERIES[index % SERIES.len()]
}

/// Colours of a map. Both scales rise evenly in lightness, so that they can be
/// read in grey, and by readers with colour vision deficiency.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum ColourScale {
    /// From violet over green to yellow (Smith and van der Walt 2015).
    #[default]
    Viridis,
    /// From blue over grey to yellow (Nuñez, Anderton and Renslow 2018).
    Cividis,
}

/// Every eighth of the 256 colours of viridis (CC0); linear between.
const VIRIDIS: [u32; 33] = [
    0x440154, 0x470D60, 0x48186A, 0x482374, 0x472D7B, 0x453781, 0x424086, 0x3E4989, 0x3B528B,
    0x375B8D, 0x33638D, 0x2F6B8E, 0x2C728E, 0x297A8E, 0x26828E, 0x23898E, 0x21918C, 0x1F988B,
    0x1FA088, 0x22A785, 0x28AE80, 0x32B67A, 0x3FBC73, 0x4EC36B, 0x5EC962, 0x70CF57, 0x84D44B,
    0x98D83E, 0xADDC30, 0xC2DF23, 0xD8E219, 0xECE51B, 0xFDE725,
];

/// The same of cividis.
const CIVIDIS: [u32; 33] = [
    0x00224E, 0x00285B, 0x002E6A, 0x053371, 0x1A386F, 0x273E6E, 0x32436D, 0x3B496C, 0x434E6C,
    0x4B546C, 0x535A6D, 0x5A5F6E, 0x61656F, 0x686A71, 0x6F7073, 0x767676, 0x7D7C78, 0x848279,
    0x8C8878, 0x938E78, 0x9B9476, 0xA39A74, 0xABA072, 0xB4A76F, 0xBCAE6C, 0xC4B468, 0xCDBB63,
    0xD5C25E, 0xDEC958, 0xE7D150, 0xF0D846, 0xF9E03A, 0xFEE838,
];

impl ColourScale {
    /// The colour at a share of the scale; beyond 0 and 1 its ends.
    pub(super) fn at(self, share: f64) -> Colour {
        let table = match self {
            Self::Viridis => &VIRIDIS,
            Self::Cividis => &CIVIDIS,
        };
        let place = share.clamp(0.0, 1.0) * (table.len() - 1) as f64;
        let index = (place as usize).min(table.len() - 2);
        let between = place - index as f64;
        let [from, to] = [table[index], table[index + 1]].map(u32::to_be_bytes);
        let [r, g, b] = [1, 2, 3].map(|byte| mixed(from[byte], to[byte], between));
        RGBColor(r, g, b)
    }
}

/// `from` at 0, `to` at 1.
fn mixed(from: u8, to: u8, share: f64) -> u8 {
    let (from, to) = (f64::from(from), f64::from(to));
    (from + share * (to - from)).round() as u8
}

/// A darker shade, for what is drawn over a line of the colour.
pub(super) fn darker(colour: Colour) -> Colour {
    let RGBColor(r, g, b) = colour;
    RGBColor(mixed(0, r, 0.6), mixed(0, g, 0.6), mixed(0, b, 0.6))
}

/// Relative luminance after WCAG 2.1, from 0 (black) to 1 (white).
pub(super) fn luminance(colour: Colour) -> f64 {
    let linear = |byte: u8| {
        let part = f64::from(byte) / 255.0;
        if part <= 0.03928 {
            part / 12.92
        } else {
            libm::pow((part + 0.055) / 1.055, 2.4)
        }
    };
    0.2126 * linear(colour.0) + 0.7152 * linear(colour.1) + 0.0722 * linear(colour.2)
}

/// Black or white, whichever stands out more on that ground.
pub(super) fn ink_on(ground: Colour) -> Colour {
    // Equal contrast with black and white: √(1.05·0.05) − 0.05.
    if luminance(ground) > 0.179 {
        SERIES[4]
    } else {
        WHITE
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Contrast after WCAG 2.1: 1 (none) to 21 (black on white).
    fn contrast(a: Colour, b: Colour) -> f64 {
        let (a, b) = (luminance(a), luminance(b));
        (a.max(b) + 0.05) / (a.min(b) + 0.05)
    }

    #[test]
    fn text_and_lines_stand_out_from_the_ground() {
        assert!((contrast(SERIES[4], WHITE) - 21.0).abs() < 1e-9);
        // WCAG 1.4.3: 4.5 for text.
        for text in [INK, MUTED, LIMIT] {
            assert!(contrast(text, WHITE) >= 4.5, "{text:?}");
        }
        // WCAG 1.4.11: 3 for graphics; the two last series keep 2 and have
        // marks of their own. Yellow, left out, is the contrast.
        for line in &SERIES[..3] {
            assert!(contrast(*line, WHITE) >= 3.0, "{line:?}");
        }
        for line in SERIES {
            assert!(contrast(line, WHITE) >= 2.0, "{line:?}");
        }
        assert!(contrast(RGBColor(0xf0, 0xe4, 0x42), WHITE) < 2.0);
    }

    #[test]
    fn marks_stand_out_from_every_colour_of_a_map() {
        for scale in [ColourScale::Viridis, ColourScale::Cividis] {
            for step in 0..=200 {
                let ground = scale.at(f64::from(step) / 200.0);
                assert!(contrast(ink_on(ground), ground) >= 4.5, "{scale:?} {step}");
            }
        }
    }

    /// A map can be read in grey: lightness rises along both scales.
    #[test]
    fn scales_rise_in_lightness() {
        for scale in [ColourScale::Viridis, ColourScale::Cividis] {
            let lightness: Vec<f64> = (0..=64)
                .map(|step| luminance(scale.at(f64::from(step) / 64.0)))
                .collect();
            assert!(lightness.is_sorted(), "{scale:?}");
        }
        let named = SERIES.map(luminance);
        assert!(!named.is_sorted(), "the measure must be able to fail");
    }

    #[test]
    fn ends_of_the_scale_hold_beyond_it() {
        let scale = ColourScale::Viridis;
        assert_eq!(scale.at(-3.0), RGBColor(0x44, 0x01, 0x54));
        assert_eq!(scale.at(7.0), RGBColor(0xfd, 0xe7, 0x25));
    }

    #[test]
    fn many_ordered_series_are_different() {
        let colours: Vec<Colour> = (0..9).map(|index| series(index, 9, true)).collect();
        for (at, colour) in colours.iter().enumerate() {
            assert!(!colours[..at].contains(colour));
        }
        assert_eq!(series(7, 9, false), series(0, 9, false));
    }
}
