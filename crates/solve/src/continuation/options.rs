//! How a path is traced, and the way to take where it branches.

/// Most points of a path, by default.
pub const DEFAULT_POINTS: usize = 2000;

/// Where to go at a bifurcation that takes the path's stability away.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Branch {
    /// Straight on, along the unstable path.
    Stay,
    /// Along the null vector to the side of [`System::side`](bimorph_domains::System::side).
    #[default]
    Plus,
    /// Against it.
    Minus,
}

/// How a path is traced. `Default` is the only place where the numbers stand.
#[derive(Debug, Clone, PartialEq)]
pub struct ContinuationOptions {
    /// Newton stops when a correction is below this fraction of the displacement, default 1e-9. Smaller: one more iteration.
    pub tolerance: f64,
    /// Newton iterations before a step is halved, default 8.
    pub iterations: usize,
    /// Longest step in s, default 0.04 of the way. Smaller: more points.
    pub longest: f64,
    /// Longest step as a fraction of s, default 0: where it exceeds `longest`, steps grow with s.
    pub growth: f64,
    /// The path arrives where s comes to this, default 1.
    pub target: f64,
    /// Largest change of a gap in one step, as a fraction of what is left of it, default 0.2: no step leads across a gap to
    /// another branch. Smaller: more points.
    pub closing: f64,
    /// Largest distance of a point from where the tangent led, in steps, default 0.5. Tangents with the requested
    /// `straightness` lead within 0.1; points further away lie on another branch.
    pub aside: f64,
    /// End where stability is lost, at a fold or a bifurcation; default false.
    pub stop_at_loss: bool,
    /// Smallest step, in s and in length scales, default 1e-12: below it the path is lost. Where contact ends a path turns within
    /// 1e-7 of a gap.
    pub smallest: f64,
    /// Smallest cosine between the tangents at both ends of a step, default 0.98. Larger: more points where the path bends.
    pub straightness: f64,
    /// Most points.
    pub points: usize,
    /// The path ends where s falls below this, default −1.
    pub lowest: f64,
    /// Treatment of bifurcations.
    pub branch: Branch,
}

impl Default for ContinuationOptions {
    fn default() -> Self {
        Self {
            tolerance: 1e-9,
            iterations: 8,
            longest: 0.04,
            growth: 0.0,
            target: 1.0,
            closing: 0.2,
            aside: 0.5,
            stop_at_loss: false,
            smallest: 1e-12,
            straightness: 0.98,
            points: DEFAULT_POINTS,
            lowest: -1.0,
            branch: Branch::Plus,
        }
    }
}
