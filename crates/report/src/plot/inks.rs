//! The inks of pictures, light and dark, and the patterns of dashes. A plotters colour encodes both.

use plotters::prelude::RGBColor;

/// The inks: class, light colour, dark colour.
macro_rules! inks {
    ($($class:literal $light:literal $dark:literal)*) => {
        /// The classes of the inks.
        pub(super) const INKS: &[&str] = &[$($class),*];
        /// Their light colours.
        pub(super) const LIGHT: &[&str] = &[$($light),*];

        /// Their dark colours.
        #[cfg(test)]
        const DARK: &[&str] = &[$($dark),*];

        /// The style element that every figure contains; a page with several inline figures needs it only once. A page
        /// may set the inks as properties of `.asoplot`, such as `--s0`. A program that does not support properties
        /// shows the light colours. The other classes: l line, f filled, e with an edge, a area with a faint edge, b
        /// bold.
        pub const STYLE: &str = concat!(
            "<style>.asoplot{color:#1b1f24;color:var(--ink,#1b1f24);max-width:100%;height:auto;",
            "font-family:Helvetica,Arial,'Liberation Sans',sans-serif}",
            ".asoplot text{fill:currentColor}.asoplot .b{font-weight:bold}",
            ".asoplot .l{fill:none;stroke:currentColor;stroke-linejoin:round}",
            ".asoplot .f,.asoplot .a{fill:currentColor}",
            ".asoplot .e{stroke:currentColor}",
            ".asoplot .a{stroke:currentColor;stroke-opacity:.4}",
            $(".asoplot .", $class, "{color:", $light, ";color:var(--", $class, ",", $light, ")}",)*
            "@media screen and (prefers-color-scheme:dark){.asoplot{",
            $("--", $class, ":", $dark, ";",)*
            "}}</style>",
        );
    };
}

// The first six light ones for series are those of Okabe and Ito; `tests` holds the first seven of both schemes apart
// for colour-blind readers. Further series differ by dashes and markers, too.
inks! {
    "ink" "#1b1f24" "#e4e6ea"
    "paper" "#ffffff" "#16181d"
    "grid" "#e1e2e2" "#3f4146"
    "faint" "#f2f2f3" "#27292e"
    "s0" "#0072b2" "#1f8ad6"
    "s1" "#d55e00" "#e0703a"
    "s2" "#009e73" "#2fd695"
    "s3" "#cc79a7" "#c27ba2"
    "s4" "#e69f00" "#f3ca23"
    "s5" "#56b4e9" "#a7c8fe"
    "s6" "#4d4d4d" "#f0eaf0"
    "s7" "#8c4a2f" "#d08b6a"
    "s8" "#6a4fa3" "#a692dd"
    "s9" "#7a8a00" "#bccb4a"
    "s10" "#00798c" "#3fb8c9"
    "s11" "#a3123b" "#ee6688"
}

/// Number of inks for series.
pub(super) const COLOURS: usize = 12;
/// Dashes for series.
const DASHES: [&str; 7] = ["", "9 5", "3 4", "12 4 3 4", "18 5", "6 3 2 3 2 3", "1.5 3"];
/// Dashes for reference lines, in the ink of text.
const REFERENCES: [&str; 5] = ["2 5", "14 4 2 4", "6 6", "10 3 2 3 2 3", ""];

pub(super) const TEXT: RGBColor = RGBColor(0, 0, 0);
pub(super) const PAPER: RGBColor = RGBColor(1, 0, 0);
pub(super) const GRID: RGBColor = RGBColor(2, 0, 0);
pub(super) const FAINT: RGBColor = RGBColor(3, 0, 0);

/// The ink of series i with pattern number `dashes`; pattern 0 is solid.
pub(super) fn series_ink(i: usize, dashes: usize) -> RGBColor {
    RGBColor((4 + i % COLOURS) as u8, (dashes % DASHES.len()) as u8, 0)
}

/// The ink of reference line i.
pub(super) fn reference_ink(i: usize) -> RGBColor {
    RGBColor(0, (DASHES.len() + i % REFERENCES.len()) as u8, 0)
}

/// The lengths of dashes and gaps of a pattern; empty for a solid line.
pub(super) fn dashes(pattern: usize) -> &'static str {
    DASHES.iter().chain(&REFERENCES).nth(pattern).copied().unwrap_or("")
}

#[cfg(test)]
mod tests {
    use super::*;

    type Vector = [f64; 3];

    /// Linear RGB as readers without red, green or blue cones see it: Machado, Oliveira and Fernandes, A
    /// physiologically-based model for simulation of color vision deficiency, IEEE TVCG 15 (2009), table 1, severity 1.
    const READERS: [[Vector; 3]; 4] = [
        [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        [
            [0.152_286, 1.052_583, -0.204_868],
            [0.114_503, 0.786_281, 0.099_216],
            [-0.003_882, -0.048_116, 1.051_998],
        ],
        [
            [0.367_322, 0.860_646, -0.227_968],
            [0.280_085, 0.672_501, 0.047_413],
            [-0.011_820, 0.042_940, 0.968_881],
        ],
        [
            [1.255_528, -0.076_749, -0.178_779],
            [-0.078_411, 0.930_809, 0.147_602],
            [0.004_733, 0.691_367, 0.303_900],
        ],
    ];
    /// Linear sRGB to X/Xn, Y/Yn, Z/Zn of the white D65 (IEC 61966-2-1).
    const WHITE: [Vector; 3] = [
        [0.433_953, 0.376_219, 0.189_828],
        [0.212_673, 0.715_152, 0.072_175],
        [0.017_758, 0.109_477, 0.872_765],
    ];

    fn times(matrix: &[Vector; 3], v: Vector) -> Vector {
        [0, 1, 2].map(|i| (0..3).map(|j| matrix[i][j] * v[j]).sum())
    }

    /// CIELAB of a colour "#rrggbb" as a reader sees it.
    fn lab(colour: &str, reader: &[Vector; 3]) -> Vector {
        let linear = [1, 3, 5].map(|i| {
            let part = f64::from(u8::from_str_radix(&colour[i..i + 2], 16).unwrap()) / 255.0;
            if part > 0.04045 {
                ((part + 0.055) / 1.055).powf(2.4)
            } else {
                part / 12.92
            }
        });
        let seen = times(reader, linear).map(|part| part.clamp(0.0, 1.0));
        let [x, y, z] = times(&WHITE, seen).map(|t| {
            let edge: f64 = 6.0 / 29.0;
            if t > edge.powi(3) {
                t.cbrt()
            } else {
                t / (3.0 * edge * edge) + 4.0 / 29.0
            }
        });
        [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
    }

    /// The least distance of two colours (CIE 1976), over all readers.
    fn least(colours: &[&str]) -> f64 {
        let mut least = f64::INFINITY;
        for reader in &READERS {
            for (i, a) in colours.iter().enumerate() {
                for b in &colours[..i] {
                    let (a, b) = (lab(a, reader), lab(b, reader));
                    least = least.min((0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt());
                }
            }
        }
        least
    }

    #[test]
    fn colours_are_told_apart_by_colour_blind_readers() {
        // CIELAB of #d55e00 by a script of its own, for all readers.
        for (reader, expected) in READERS.iter().zip([
            [54.19, 43.27, 63.28],
            [47.50, -4.04, 53.56],
            [58.00, -5.54, 62.35],
            [53.91, 65.13, 30.68],
        ]) {
            let found = lab("#d55e00", reader);
            assert!((0..3).all(|k| (found[k] - expected[k]).abs() < 0.05), "{found:?}");
        }
        // 2.3 is a difference that is just noticed. This pink and this blue grey differ by 45 for most, by 8 for some.
        assert!(least(&["#b8578e", "#6f7f9a"]) < 15.0);
        for colours in [LIGHT, DARK] {
            let found = least(&colours[4..11]);
            assert!(found > 16.0, "{found}");
        }
    }
}
