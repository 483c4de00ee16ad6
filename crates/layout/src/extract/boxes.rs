//! Finding boxes that overlap a box: a packed tree over boxes sorted along a Z curve (Kamel and Faloutsos 1993, with Morton's order).

/// Boxes of one node.
const FAN: usize = 8;

/// Lower left and upper right corner.
pub(super) type Extent = [[f64; 2]; 2];

/// The box around some points.
pub(super) fn around(points: impl IntoIterator<Item = [f64; 2]>) -> Extent {
    let none = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
    points
        .into_iter()
        .fold(none, |[low, high], p| [[low[0].min(p[0]), low[1].min(p[1])], [high[0].max(p[0]), high[1].max(p[1])]])
}

fn join(a: &Extent, b: &Extent) -> Extent {
    around([a[0], a[1], b[0], b[1]])
}

fn overlap(a: &Extent, b: &Extent) -> bool {
    // all four comparisons at once cost less than a branch for each
    (a[0][0] <= b[1][0]) & (b[0][0] <= a[1][0]) & (a[0][1] <= b[1][1]) & (b[0][1] <= a[1][1])
}

/// Many boxes, found by place.
#[derive(Debug, Default)]
pub(super) struct Boxes {
    /// Numbers of the boxes in the order of the lowest level.
    order: Vec<u32>,
    /// Levels from the boxes themselves to the root.
    levels: Vec<Vec<Extent>>,
}

impl Boxes {
    /// Sorts the boxes in. Cost: n log n.
    pub(super) fn of(boxes: &[Extent]) -> Self {
        let Some(all) = boxes.iter().copied().reduce(|a, b| join(&a, &b)) else { return Self::default() };
        let side = (all[1][0] - all[0][0]).max(all[1][1] - all[0][1]).max(f64::MIN_POSITIVE);
        let key = |b: &Extent| {
            let at = |i: usize| (((b[0][i] + b[1][i]) * 0.5 - all[0][i]) / side * 65535.0) as u32;
            spread(at(0)) | spread(at(1)) << 1
        };
        let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
        order.sort_by_cached_key(|k| (key(&boxes[*k as usize]), *k));
        let mut levels = vec![order.iter().map(|k| boxes[*k as usize]).collect::<Vec<_>>()];
        while levels[levels.len() - 1].len() > 1 {
            let below = &levels[levels.len() - 1];
            let up = below.chunks(FAN).map(|c| c.iter().skip(1).fold(c[0], |a, b| join(&a, b))).collect();
            levels.push(up);
        }
        Self { order, levels }
    }

    /// Numbers of all boxes that overlap this one, sorted.
    pub(super) fn overlapping(&self, window: &Extent) -> Vec<u32> {
        let mut found = Vec::new();
        let Some(root) = self.levels.last().filter(|root| overlap(&root[0], window)) else { return found };
        if root.len() == self.order.len() {
            return self.order.clone();
        }
        let mut open = Vec::with_capacity(FAN * self.levels.len());
        open.push((self.levels.len() - 1, 0usize));
        while let Some((level, k)) = open.pop() {
            let below = &self.levels[level - 1];
            let first = k * FAN;
            let children = below[first..below.len().min(first + FAN)].iter().enumerate();
            let near = children.filter(|(_, child)| overlap(child, window)).map(|(child, _)| first + child);
            if level == 1 {
                found.extend(near.map(|child| self.order[child]));
            } else {
                open.extend(near.map(|child| (level - 1, child)));
            }
        }
        found.sort_unstable();
        found
    }
}

/// Bits of a number moved to the even places.
fn spread(x: u32) -> u32 {
    let mut x = x & 0xffff;
    for (shift, mask) in [(8, 0x00ff_00ff), (4, 0x0f0f_0f0f), (2, 0x3333_3333), (1, 0x5555_5555)] {
        x = (x | x << shift) & mask;
    }
    x
}

#[cfg(test)]
mod tests {
    //! The tree finds exactly the boxes that a search of all of them finds.
    use super::*;

    #[test]
    fn the_same_as_a_look_at_all() {
        let boxes: Vec<Extent> = (0..500)
            .map(|k| {
                let (x, y) = (f64::from(k * 37 % 101), f64::from(k * 53 % 97));
                [[x, y], [x + f64::from(k % 7), y + f64::from(k % 11)]]
            })
            .collect();
        let tree = Boxes::of(&boxes);
        for k in (0..500).step_by(17) {
            let window = [[boxes[k][0][0] - 1.5, boxes[k][0][1] - 2.0], boxes[k][1]];
            let all: Vec<u32> = (0..500).filter(|j| overlap(&boxes[*j as usize], &window)).collect();
            assert_eq!(tree.overlapping(&window), all);
        }
        assert!(Boxes::of(&[]).overlapping(&[[0.0; 2], [1.0; 2]]).is_empty());
    }
}
