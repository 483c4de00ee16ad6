//! Shapes of a symbol: polygons, boxes, wires and flashes.

use super::{CifFault, CifParser, CifResult, LONGEST};
use crate::cells::Transform;
use crate::outline::{self, Style};

impl CifParser<'_> {
    pub(super) fn points(
        &mut self,
        what: &'static str,
        least: usize,
        expected: &'static str,
    ) -> CifResult<Vec<[f64; 2]>> {
        let mut points = Vec::new();
        while self.reader.number_follows()? {
            points.push(self.point()?);
            if points.len() > LONGEST {
                return Err(self.reader.error(CifFault::Points { what, count: points.len(), expected }));
            }
        }
        if points.len() < least {
            return Err(self.reader.error(CifFault::Points { what, count: points.len(), expected }));
        }
        self.reader.end()?;
        Ok(points)
    }

    pub(super) fn polygon(&mut self) -> CifResult<()> {
        self.reader.advance();
        let points = self.points("a polygon", 3, "3 to 1048576")?;
        self.add(points)
    }

    /// B length width x y [direction]: length along the direction.
    pub(super) fn block(&mut self) -> CifResult<()> {
        self.reader.advance();
        let [l, w] = [self.size("the length of a box")?, self.size("the width of a box")?].map(|v| v / 2.0);
        let centre = self.point()?;
        let mut turn = Transform::IDENTITY;
        if self.reader.number_follows()? {
            turn = self.direction()?;
        }
        self.reader.end()?;
        let place = Transform::shift(centre).after(&turn);
        self.add([[-l, -w], [l, -w], [l, w], [-l, w]].map(|p| place.apply(p)).to_vec())
    }

    pub(super) fn direction(&mut self) -> CifResult<Transform> {
        let direction = [self.reader.integer()? as f64, self.reader.integer()? as f64];
        if direction == [0.0; 2] {
            return Err(self.reader.error(CifFault::Direction));
        }
        Ok(Transform::turn(direction))
    }

    pub(super) fn wire(&mut self) -> CifResult<()> {
        self.reader.advance();
        let width = self.size("the width of a wire")?;
        let points = self.points("a wire", 1, "1 to 1048576")?;
        outline::wire(&points, width, Style::Round).into_iter().try_for_each(|contour| self.add(contour))
    }

    pub(super) fn flash(&mut self) -> CifResult<()> {
        self.reader.advance();
        let diameter = self.size("the diameter of a flash")?;
        let centre = self.point()?;
        self.reader.end()?;
        self.add(outline::circle(centre, diameter))
    }
}
