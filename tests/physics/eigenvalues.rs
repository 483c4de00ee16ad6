//! Natural frequencies where eigenvalues are hard to have: very stiff beside very soft, many alike, short stout pieces.

use crate::{close, model};
use bimorph::analysis::AnalysisError;
use bimorph::analysis::modes::{ModesResult, modes};
use bimorph::compile::{CompileOptions, Junctions};

fn found(text: &str, segments: usize, count: usize) -> Result<ModesResult, AnalysisError> {
    let options =
        CompileOptions { segments: Some(segments), junctions: Junctions::Centreline, ..CompileOptions::default() };
    modes(&model(text, &options), count, &[])
}

fn settled(result: &ModesResult) {
    assert!(result.residuals.iter().all(|&r| r <= 1e-8), "{:?}", result.residuals);
}

/// Two thin beams with one two hundred times as wide between them: 998.378613683932 Hz (dynamic stiffness of the three
/// beams to 40 digits). Two hundred segments, whose assembled stiffness has lost it, come as near as the mesh allows.
#[test]
fn widths_apart_keep_their_digits() {
    let text = "anchor p1 [a] []\nbeam2d p1 [a b] [l=80u w=0.5u]\nbeam2d p1 [b c] [l=150u w=100u]\n\
                beam2d p1 [c d] [l=120u w=0.5u]";
    for (segments, tolerance) in [(2, 1e-6), (40, 1e-10), (200, 1e-11)] {
        let result = found(text, segments, 3).unwrap();
        close(result.frequencies_hz[0], 998.378613683932, tolerance);
        settled(&result);
    }
}

/// Beams a thousand times apart in width, cut small: rounding leaves nothing of the soft stiffness, and no frequency is
/// told.
#[test]
fn what_rounding_hides_is_refused() {
    let text = "anchor p1 [a] []\nbeam2d p1 [a b] [l=80u w=0.02u h=0.02u]\nbeam2d p1 [b c] [l=150u w=100u]\n\
                beam2d p1 [c d] [l=120u w=0.02u h=0.02u]";
    let refused = found(text, 400, 2);
    assert!(matches!(&refused, Err(AnalysisError::NotConverged { .. })), "{refused:?}");
}

/// Forty equal cantilevers have every frequency forty times; all of them are found, by the dense way and by Lanczos.
#[test]
fn equal_frequencies_are_counted() {
    let alone = "anchor p1 [a] []\nbeam2d p1 [a b] [l=100u w=2u]";
    let mut many = String::new();
    for k in 0..40 {
        many += &format!("anchor p1 [a{k}] []\nbeam2d p1 [a{k} b{k}] [l=100u w=2u]\n");
    }
    for segments in [1, 8] {
        let one = found(alone, segments, 2).unwrap();
        let all = found(&many, segments, 41).unwrap();
        settled(&all);
        for (k, f) in all.frequencies_hz.iter().enumerate() {
            close(*f, one.frequencies_hz[k / 40], 1e-9);
        }
    }
}

/// A chain of pieces as long as they are wide, each turned against the last by up to 140°: junctions may not take more
/// mass than the pieces bring, and the modes come.
#[test]
fn stout_pieces_have_modes() {
    let mut text = "anchor p1 [q0] [l=10u w=10u oz=-pi/2]\n".to_owned();
    for k in 0..40 {
        text += &format!("beam2d p1 [q{k} q{}] [l=5u w=5u oz=deg({})]\n", k + 1, (k * k * 20) % 141);
    }
    let compiled = model(&text, &CompileOptions::default());
    assert!(compiled.parts.system.model.bodies.iter().all(|b| b.mass > 0.0));
    let result = modes(&compiled, 3, &[]).unwrap();
    settled(&result);
    assert_eq!(result.frequencies_hz.len(), 3);
}
