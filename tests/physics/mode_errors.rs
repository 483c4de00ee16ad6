//! Each mode has the estimate of its own error, about a loaded state as about the drawing.

use crate::model;
use bimorph::analysis::mesh::modes_fitted;
use bimorph::analysis::modes::modes;
use bimorph::compile::CompileOptions;

/// A slender and a stout beam under forces: the modes of the first are some hundred times as far off as those of the second on equal meshes.
const UNLIKE: &str = "
    anchor p1 [a] []
    beam2d p1 [a b] [l=200u w=2u]
    f2d * [b] [F=2u oz=pi/2]
    anchor p1 [c] []
    beam2d p1 [c d] [l=40u w=8u oz=pi]
    beam2d p1 [d e] [l=30u w=8u oz=pi/2]
    f2d * [e] [F=50u]";

/// Under forces each estimate is the distance from 40 segments a beam within a factor 3 on a mesh that is given, and no smaller than a
/// third of it on the one for the tolerance, where that of the state adds to it. Estimates of one table differ by more than ten. (One
/// for all was the largest: 5e4 times what the best mode is off.)
#[test]
fn each_mode_has_its_own_estimate_about_a_loaded_state() {
    const COUNT: usize = 8;
    let with = |segments, tol| model(UNLIKE, &CompileOptions { segments, tol, ..CompileOptions::default() });
    let reference = modes(&with(Some(40), 1e-3), COUNT, &[]).unwrap().frequencies_hz;
    for (segments, tol) in [(Some(4), 1e-2), (None, 1e-2)] {
        let (_, found, _) = modes_fitted(&with(segments, tol), COUNT, &[]).unwrap();
        let estimates: Vec<f64> = found.errors.iter().map(|error| error.unwrap().abs()).collect();
        for (k, (f, exact)) in found.frequencies_hz.iter().zip(&reference).enumerate() {
            let (error, estimate) = ((f / exact - 1.0).abs(), estimates[k]);
            println!("{segments:?} {tol:e} mode {k}: {error:.2e}, estimate {estimate:.2e}");
            let most = if segments.is_some() { 3.0 * error } else { tol };
            assert!(error <= 3.0 * estimate && estimate <= most, "mode {k}: {error:e}, estimate {estimate:e}");
        }
        let (least, most) = estimates.iter().fold((f64::MAX, 0.0), |(a, b): (f64, f64), e| (a.min(*e), b.max(*e)));
        assert!(most > 10.0 * least, "{least:e} to {most:e}");
        assert!(found.estimated_error.unwrap() >= most);
    }
}
