//! Pictures of results: line charts over a shared axis, the mechanism at rest and deflected, and pages of both.
//!
//! Everything is drawn as SVG first ([`svg`]). PNG is that SVG put into pixels with a font that travels inside the
//! program, so it needs nothing installed; HTML is a small page around it. The same result draws the same bytes.

pub mod animation;
pub mod axis;
pub mod bode;
pub mod chart;
pub mod histogram;
mod labels;
pub mod log_axis;
pub mod loglog;
pub mod mechanism;
mod parts;
pub mod plane;
#[cfg(feature = "png")]
pub mod render;
pub mod shapes;
pub mod svg;

pub use svg::Picture;

/// Colours of successive curves: the palette of Okabe and Ito (2008), which colour-blind readers can distinguish.
pub const PALETTE: [&str; 7] = ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000"];

/// Puts pictures under each other, left edges aligned.
pub fn stack(pictures: &[Picture]) -> Picture {
    let width = pictures.iter().map(|p| p.width).fold(0.0, f64::max);
    let mut whole = Picture::new(width, pictures.iter().map(|p| p.height).sum());
    let mut y = 0.0;
    for picture in pictures {
        whole.place(picture, 0.0, y);
        y += picture.height;
    }
    whole
}
