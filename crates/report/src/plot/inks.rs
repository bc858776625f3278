//! The inks of pictures, light and dark, and the patterns of dashes. A plotters colour encodes both.

use plotters::prelude::RGBColor;

/// The inks: class, light colour, dark colour.
macro_rules! inks {
    ($($class:literal $light:literal $dark:literal)*) => {
        /// The classes of the inks.
        pub(super) const INKS: &[&str] = &[$($class),*];
        /// Their light colours.
        pub(super) const LIGHT: &[&str] = &[$($light),*];

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

inks! {
    "ink" "#1b1f24" "#e4e6ea"
    "paper" "#ffffff" "#16181d"
    "grid" "#e1e2e2" "#3f4146"
    "faint" "#f2f2f3" "#27292e"
    "s0" "#0072b2" "#4ba3e3"
    "s1" "#d55e00" "#f58a42"
    "s2" "#009e73" "#2fc79b"
    "s3" "#b8578e" "#e39ac6"
    "s4" "#c98a00" "#f0b93a"
    "s5" "#3a9bd6" "#9ad2f6"
    "s6" "#4d4d4d" "#b9bec6"
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
    DASHES
        .iter()
        .chain(&REFERENCES)
        .nth(pattern)
        .copied()
        .unwrap_or("")
}
