//! A chart as a web page that needs nothing else: the picture, the definitions, and every point in a table.

use super::table::{HEADS, caption, cells};
use bimorph::analysis::chart::{Chart, ChartPart};
use bimorph::results::plot::Picture;
use bimorph::results::plot::svg::escape;
use std::fmt::Write;

const STYLE: &str = "body{font-family:sans-serif;color:#333;margin:2em auto;max-width:62em;padding:0 1em}\
    svg{width:100%;height:auto}table{border-collapse:collapse;margin:.5em 0 2em}\
    th,td{text-align:right;padding:.15em .9em;border-bottom:1px solid #e4e4e4}\
    th:first-child,td:first-child{text-align:left}td.failed{text-align:left;color:#a33}caption{text-align:left}";

/// The page.
pub(super) fn html(title: &str, chart: &Chart, picture: &Picture) -> String {
    let mut text = format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width\">\n<title>{}</title>\n<style>{STYLE}</style>\n</head>\n\
         <body>\n{}",
        escape(title),
        picture.to_svg()
    );
    let _ = writeln!(
        text,
        "<p>Errors are root mean squares over {} and all output times, relative to the amplitude. The precision part is \
         measured against the same model integrated far more tightly{}, the order part against the finest model. Errors and \
         counts are the same on every run; times are wall-clock times of the machine that made this page.</p>",
        escape(&chart.signals.join(", ")),
        chart.reference_error.map(|e| format!(" (good to {e:.1e})")).unwrap_or_default()
    );
    for part in ChartPart::ALL {
        let points: Vec<_> = chart.points.iter().filter(|p| p.part == part).collect();
        if points.is_empty() {
            continue;
        }
        let _ = write!(text, "<table>\n<caption>{}</caption>\n<tr>", escape(caption(part)));
        for head in HEADS {
            let _ = write!(text, "<th>{head}</th>");
        }
        text.push_str("</tr>\n");
        for point in points {
            let cells = cells(point);
            text.push_str("<tr>");
            match &point.failed {
                Some(reason) => {
                    cells[..4].iter().for_each(|c| {
                        let _ = write!(text, "<td>{}</td>", escape(c));
                    });
                    let _ = write!(text, "<td class=\"failed\" colspan=\"4\">{}</td>", escape(reason));
                }
                None => cells.iter().for_each(|c| {
                    let _ = write!(text, "<td>{}</td>", escape(c));
                }),
            }
            text.push_str("</tr>\n");
        }
        text.push_str("</table>\n");
    }
    text.push_str("</body>\n</html>\n");
    text
}
