//! Statistical graphics as SVG in one style, independent of the source of the numbers.
//!
//! plotters draws the charts, coordinates, meshes and elements, on our own backend that writes SVG with classes. This
//! module adds what plotters lacks: labels that fit, thinning, legends, panels with common axes, shades.
//!
//! Series differ by colour (Okabe and Ito's palette, safe for colour-blind readers), by dashes and by markers. Colours
//! are CSS classes: a figure follows the reader's light or dark scheme, and prints light. A document is complete in
//! itself, and many can be inline in one page: no element has an id and every rule is scoped. The same input gives the
//! same text.

mod axis;
#[allow(clippy::format_push_string, reason = "attributes of a few characters")]
mod backend;
mod chart;
mod heat;
mod legend;
mod metrics;
mod multiples;
mod spec;
mod thin;

#[cfg(test)]
mod tests;

pub use backend::{STYLE, WIDTH};
pub use heat::{Heat, HeatCell};
pub use multiples::{Picture, Sharing, multiples_of_width, small_multiples};
pub use spec::{Course, Plot, PlotAxis, Point, Reference, Scale, Series, Style};
