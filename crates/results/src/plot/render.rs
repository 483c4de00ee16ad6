//! Pictures as files: SVG, PNG and a web page.

use super::svg::{Picture, escape};
use resvg::{tiny_skia, usvg};
use std::sync::Arc;
use thiserror::Error;

/// Pixels of a PNG for each unit of the drawing.
const DENSITY: f32 = 2.0;

/// Why a picture did not become pixels.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum RenderError {
    /// The drawing is not understood.
    #[error("the picture cannot be drawn: {0}")]
    Svg(#[from] usvg::Error),
    /// Too large or empty.
    #[error("the picture of {width} x {height} pixels cannot be held in memory")]
    Size {
        /// Width (px).
        width: u32,
        /// Height (px).
        height: u32,
    },
    /// The pixels cannot be packed.
    #[error("the picture cannot be packed as PNG: {0}")]
    Png(String),
}

/// The picture in pixels. Text is set in DejaVu Sans, which the program carries.
///
/// # Errors
/// See [`RenderError`].
pub fn png(picture: &Picture) -> Result<Vec<u8>, RenderError> {
    let mut options = usvg::Options { font_family: "DejaVu Sans".to_owned(), ..usvg::Options::default() };
    Arc::make_mut(&mut options.fontdb).load_font_data(dejavu::sans::regular().to_vec());
    let tree = usvg::Tree::from_str(&picture.to_svg(), &options)?;
    let size = tree.size();
    let [width, height] = [size.width(), size.height()].map(|x| (x * DENSITY).ceil() as u32);
    let mut pixels = tiny_skia::Pixmap::new(width, height).ok_or(RenderError::Size { width, height })?;
    resvg::render(&tree, tiny_skia::Transform::from_scale(DENSITY, DENSITY), &mut pixels.as_mut());
    pixels.encode_png().map_err(|e| RenderError::Png(e.to_string()))
}

/// A page that holds the picture and needs nothing else.
pub fn html(title: &str, picture: &Picture) -> String {
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width\">\n<title>{}</title>\n\
         <style>body{{margin:2em auto;max-width:60em}}svg{{width:100%;height:auto}}</style>\n</head>\n<body>\n{}</body>\n</html>\n",
        escape(title),
        picture.to_svg()
    )
}

#[cfg(test)]
mod tests {
    use super::super::svg::Align;
    use super::*;

    /// Text leaves ink on a machine without any fonts: the program brings its own.
    #[test]
    fn text_is_drawn() {
        let mut picture = Picture::new(60.0, 30.0);
        let blank = png(&picture).unwrap();
        picture.text(5.0, 20.0, 14.0, Align::Start, "#000000", "µm");
        let lettered = png(&picture).unwrap();
        assert!(lettered.starts_with(b"\x89PNG"));
        assert_ne!(blank, lettered);
    }
}
