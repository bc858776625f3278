//! Statistical graphics as SVG or PDF in one style, independent of the source of the numbers.
//!
//! plotters draws the charts, coordinates, meshes and elements, on our own backend that collects marks, of which SVG
//! with classes and PDF are written. This module adds what plotters lacks: labels that fit, thinning, legends, panels
//! with common axes, shades.
//!
//! Series differ by colour (the first seven from Okabe and Ito's palette, safe for colour-blind readers), by dashes and
//! by markers. Colours are CSS classes: a figure follows the reader's light or dark scheme, and prints light. A
//! document is complete in itself, and many can be inline in one page: no element has an id and every rule is scoped.
//! The same input gives the same text.

mod axis;
mod backend;
mod chart;
mod ends;
mod heat;
mod inks;
mod legend;
mod metrics;
mod multiples;
mod pdf;
mod scene;
mod spec;
mod svg;
mod thin;

#[cfg(test)]
mod tests;

pub use backend::{NARROW, WIDTH};
pub use heat::{Heat, HeatCell};
pub use inks::STYLE;
pub use metrics::widest_note;
pub use multiples::{Picture, Sharing, multiples_of_width, small_multiples};
pub use scene::Drawing;
pub use spec::{Course, Plot, PlotAxis, Point, Reference, Scale, Series, Style};
pub(crate) use spec::{distinct, extent, points};
