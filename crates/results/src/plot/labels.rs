//! Places of labels beside points, so that none covers another.
//!
//! Each label takes the first free place about its point: beside it, above or below, then further away. Places off the curves come first, and
//! labels that come first have the better places. Cost: labels × (labels + points of curves).

use super::svg::Align;

/// Average width of a letter, in sizes of the font: enough room for DejaVu Sans.
const LETTER: f64 = 0.62;
/// Rings of places about a point.
const RINGS: usize = 4;
/// Distance of the points of a curve that labels avoid (px), and most of them between two corners.
const SPACING: f64 = 4.0;
const MAX_STEPS: usize = 500;

/// A rectangle on the picture: left, top, right, bottom (px).
pub(super) type LabelExtent = [f64; 4];

/// Labels placed so far.
pub(super) struct LabelPlaces {
    within: LabelExtent,
    taken: Vec<LabelExtent>,
    curves: Vec<[f64; 2]>,
    rings: usize,
}

/// Where a label stands: its base point and alignment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct LabelPlace {
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) align: Align,
}

impl LabelPlaces {
    /// No label yet; all lie within `within`.
    pub(super) fn new(within: LabelExtent) -> Self {
        Self { within, taken: Vec::new(), curves: Vec::new(), rings: RINGS }
    }

    /// Labels stand close to their points, or not at all.
    pub(super) fn close(self) -> Self {
        Self { rings: 1, ..self }
    }

    /// Labels stand off a curve where they can.
    pub(super) fn avoid(&mut self, line: &[[f64; 2]]) {
        for pair in line.windows(2) {
            let (from, to) = (pair[0], pair[1]);
            let steps = (((to[0] - from[0]).hypot(to[1] - from[1]) / SPACING).ceil() as usize).clamp(1, MAX_STEPS);
            let at = |k: usize| {
                let s = k as f64 / steps as f64;
                [from[0] + s * (to[0] - from[0]), from[1] + s * (to[1] - from[1])]
            };
            self.curves.extend((0..=steps).map(at));
        }
    }

    /// Keeps a square of this half width about a point free of labels.
    pub(super) fn keep_free(&mut self, [x, y]: [f64; 2], half: f64) {
        self.taken.push([x - half, y - half, x + half, y + half]);
    }

    /// The place of a label beside a point; `None` where there is no room.
    pub(super) fn place(&mut self, at: [f64; 2], size: f64, text: &str) -> Option<LabelPlace> {
        let wide = LETTER * size * text.chars().count() as f64;
        let (extent, place) = [true, false].iter().find_map(|off| self.find(at, size, wide, *off))?;
        self.taken.push(extent);
        Some(place)
    }

    fn find(&self, [x, y]: [f64; 2], size: f64, wide: f64, off: bool) -> Option<(LabelExtent, LabelPlace)> {
        for ring in 0..self.rings {
            let out = 8.0 + 1.3 * size * ring as f64;
            let rows = [y - out, y + out + 0.8 * size, y + 0.35 * size];
            let sides = [(x + 9.0, Align::Start), (x - 9.0, Align::End), (x, Align::Middle)];
            for (row, base) in rows.into_iter().enumerate() {
                for (column, (at, align)) in sides.into_iter().enumerate() {
                    // beside the point there is one row, and none across it
                    if row == 2 && (column == 2 || ring > 0) {
                        continue;
                    }
                    let left = match align {
                        Align::Start => at,
                        Align::Middle => at - wide / 2.0,
                        Align::End => at - wide,
                    };
                    let extent = [left, base - 0.8 * size, left + wide, base + 0.25 * size];
                    if self.is_free(&extent) && !(off && self.is_on_curve(&extent)) {
                        return Some((extent, LabelPlace { x: at, y: base, align }));
                    }
                }
            }
        }
        None
    }

    fn is_on_curve(&self, [left, top, right, bottom]: &LabelExtent) -> bool {
        self.curves.iter().any(|[x, y]| (*left..=*right).contains(x) && (*top..=*bottom).contains(y))
    }

    fn is_free(&self, [left, top, right, bottom]: &LabelExtent) -> bool {
        let within =
            *left >= self.within[0] && *top >= self.within[1] && *right <= self.within[2] && *bottom <= self.within[3];
        within && self.taken.iter().all(|t| *right <= t[0] || *left >= t[2] || *bottom <= t[1] || *top >= t[3])
    }
}

#[cfg(test)]
mod tests {
    //! Labels of points on one another do not overlap, stay within the picture, and end where there is no room left.
    use super::*;

    #[test]
    fn labels_stand_off_curves() {
        let mut places = LabelPlaces::new([0.0, 0.0, 300.0, 200.0]);
        // through the place that comes first: right above the point
        places.avoid(&[[100.0, 95.0], [300.0, 85.0]]);
        let place = places.place([100.0, 100.0], 12.0, "release").unwrap();
        assert_eq!(place, LabelPlace { x: 91.0, y: 92.0, align: Align::End });
    }

    #[test]
    fn labels_do_not_overlap() {
        let mut places = LabelPlaces::new([0.0, 0.0, 300.0, 200.0]);
        let found: Vec<LabelPlace> = (0..40)
            .filter_map(|k| places.place([150.0 + f64::from(k % 3), 100.0], 12.0, "pull-in at 12.3 V"))
            .collect();
        assert!(found.len() >= 6 && found.len() < 40, "{}", found.len());
        for (k, a) in places.taken.iter().enumerate() {
            assert!(a[0] >= 0.0 && a[1] >= 0.0 && a[2] <= 300.0 && a[3] <= 200.0, "{a:?}");
            for b in &places.taken[..k] {
                assert!(a[2] <= b[0] || a[0] >= b[2] || a[3] <= b[1] || a[1] >= b[3], "{a:?} {b:?}");
            }
        }
    }
}
