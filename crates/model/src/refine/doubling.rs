//! The mesh for whatever an analysis gives: its results are compared with those of twice the segments.
//!
//! The difference of the two is the error of the coarser one but for a fraction 2^−p, p the order of convergence;
//! Richardson's rule takes that into account, with p = 2, the order of what stretches. Bending converges faster, and
//! its error is overestimated by a quarter. Where it exceeds the tolerance, each group of equal beams is doubled alone.
//! The change is the contribution of that group, and the groups with the largest gain per body are refined until the
//! predicted sum is within the tolerance. Then the prediction is computed.
//!
//! Reference: L. F. Richardson, "The deferred approach to the limit", Phil. Trans. R. Soc. A 226 (1927).

use super::groups::Groups;
use super::mesh_target::Mesh;
use crate::options::CompileOptions;
use bimorph_structure::Structure;

/// Meshes that are compared with their double at most.
const MAX_PASSES: usize = 10;
/// Segments of all beams together, doubled, beyond which nothing is compared.
const MAX_SEGMENTS: usize = 60_000;
/// Groups that are doubled alone at most.
const MAX_GROUPS: usize = 8;
/// Results that decide, at most: the worst.
const MAX_RESULTS: usize = 24;

/// A number that an analysis gives, and the size to which its error is relative, in one unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Output {
    /// The number; NaN where it is unknown.
    pub value: f64,
    /// Scale of the error: the value that an error of 1 refers to.
    pub scale: f64,
}

/// Gives the results of a mesh, always as many.
pub type Analyse<'a, E> = &'a mut dyn FnMut(&[usize]) -> Result<Vec<Output>, E>;

/// Refines from `segments` until the results hold the tolerance.
///
/// [`Mesh::estimated_error`] is that of the worst result: none where the mesh twice as fine as the first has no results or would be
/// too fine. Where refinement does not help, or makes worse, it is beyond the tolerance, and the mesh is the best of those compared.
///
/// # Errors
/// Errors of the analysis on the first mesh.
pub fn fit<E>(
    structure: &Structure,
    options: &CompileOptions,
    mut segments: Vec<usize>,
    analyse: Analyse<'_, E>,
) -> Result<Mesh, E> {
    let groups = Groups::new(&structure.beams).merged(&structure.beams, MAX_GROUPS);
    let order = |segments: &[usize], estimated_error, passes| Mesh {
        segments: segments.to_vec(),
        estimated_error,
        modes_in_band: 0,
        passes,
    };
    let mut coarse = analyse(&segments)?;
    let (mut before, mut slow) = ((f64::INFINITY, usize::MAX), 0);
    // of all that were compared: where rounding begins, finer meshes are worse
    let mut best: Option<Mesh> = None;
    for passes in 1..=MAX_PASSES {
        let twice = doubled(options, &segments, |_| true);
        if twice == segments || twice.iter().sum::<usize>() > MAX_SEGMENTS {
            // without beams there is no mesh to be wrong
            let none = (twice == segments).then_some(0.0);
            return Ok(best.unwrap_or_else(|| order(&segments, none, passes)));
        }
        let Ok(fine) = analyse(&twice) else { return Ok(best.unwrap_or_else(|| order(&segments, None, passes))) };
        let errors = differences(&coarse, &fine);
        let worst = errors.iter().fold(0.0, |m: f64, e| m.max(e.abs()));
        let here = order(&segments, Some(worst), passes);
        if worst <= options.errors().comparison() {
            return Ok(here);
        }
        best = Some(best.filter(|best| best.estimated_error.is_some_and(|least| least <= worst)).unwrap_or(here));
        // where the prediction did not help, twice the segments do; if not, it is a kink of the results (contact, a snap), or rounding.
        // A few segments more need not halve the error
        let all = segments.iter().sum::<usize>();
        let fewer = (before.1 as f64 / all as f64).clamp(0.5, 1.0);
        slow = if worst > fewer * before.0 { slow + 1 } else { 0 };
        if passes == MAX_PASSES || slow > 1 {
            break;
        }
        before = (worst, all);
        if slow == 1 {
            (segments, coarse) = (twice, fine);
            continue;
        }
        let mut decide: Vec<usize> =
            (0..errors.len()).filter(|&j| errors[j].abs() > options.errors().minor()).collect();
        decide.sort_by(|&i, &j| errors[j].abs().total_cmp(&errors[i].abs()).then(i.cmp(&j)));
        decide.truncate(MAX_RESULTS);
        let shares = shares(options, &groups, &segments, &coarse, (&errors, &decide), analyse);
        let next = match shares {
            Some(shares) => {
                let goals = vec![options.errors().predicted_comparison(); decide.len()];
                groups.fewest(options, &shares, &goals, &segments, &segments)
            }
            None => twice.clone(),
        };
        let enough = next.iter().sum::<usize>() < twice.iter().sum::<usize>();
        (segments, coarse) = match next {
            next if next == segments || next == twice => (twice, fine),
            // far from the goal the prediction is a guess: no further than twice as fine at once, then four times
            next if enough || passes > 1 => {
                let results = analyse(&next);
                let Ok(results) = results else { break };
                (next, results)
            }
            _ => (twice, fine),
        };
    }
    Ok(best.unwrap_or_else(|| order(&segments, None, MAX_PASSES)))
}

/// The estimate of a mesh as it is: the change with twice the segments.
///
/// # Errors
/// Errors of the analysis on the mesh.
pub fn estimate<E>(options: &CompileOptions, segments: Vec<usize>, analyse: Analyse<'_, E>) -> Result<Mesh, E> {
    let worst = |errors: Vec<f64>| errors.iter().fold(0.0, |m: f64, e| m.max(e.abs()));
    let estimated_error = errors(options, &segments, analyse)?.map(worst);
    Ok(Mesh { segments, estimated_error, modes_in_band: 0, passes: 1 })
}

/// The relative error of each result of a mesh; none where the finer mesh has no results or would be too fine.
///
/// # Errors
/// Errors of the analysis on the mesh.
pub fn errors<E>(options: &CompileOptions, segments: &[usize], analyse: Analyse<'_, E>) -> Result<Option<Vec<f64>>, E> {
    let coarse = analyse(segments)?;
    let twice = doubled(options, segments, |_| true);
    let comparable = twice.iter().sum::<usize>() <= MAX_SEGMENTS;
    let fine = if comparable { analyse(&twice).ok() } else { None };
    Ok(fine.map(|fine| differences(&coarse, &fine)))
}

/// The mesh of twice the segments; none where it would be too fine to compare with.
pub fn twice(options: &CompileOptions, order: &Mesh) -> Option<Mesh> {
    let segments = doubled(options, &order.segments, |_| true);
    (segments.iter().sum::<usize>() <= MAX_SEGMENTS).then(|| Mesh { segments, ..order.clone() })
}

/// For each result that decides, what each group contributes to its error; none where a mesh has no results.
fn shares<E>(
    options: &CompileOptions,
    groups: &Groups,
    segments: &[usize],
    coarse: &[Output],
    (errors, decide): (&[f64], &[usize]),
    analyse: Analyse<'_, E>,
) -> Option<Vec<Vec<f64>>> {
    if groups.0.len() == 1 {
        return Some(decide.iter().map(|&j| vec![errors[j]]).collect());
    }
    let mut shares = vec![Vec::with_capacity(groups.0.len()); decide.len()];
    for group in &groups.0 {
        let alone = doubled(options, segments, |beam| group.contains(&beam));
        let errors = differences(coarse, &analyse(&alone).ok()?);
        for (row, &j) in shares.iter_mut().zip(decide) {
            row.push(errors[j]);
        }
    }
    shares.iter().flatten().all(|e| e.is_finite()).then_some(shares)
}

/// Twice the segments of some beams; rigid ones stay rigid.
pub fn doubled(options: &CompileOptions, segments: &[usize], some: impl Fn(usize) -> bool) -> Vec<usize> {
    let twice = |n: usize| if n == 0 { 0 } else { options.scheme.segments(2 * n) };
    segments.iter().enumerate().map(|(beam, &n)| if some(beam) { twice(n) } else { n }).collect()
}

/// Fraction of an error that twice the segments remove, by Richardson's rule: stretching converges with the second
/// order for every scheme.
const REST: f64 = 1.0 - 0.25;

/// Relative error of a number of a mesh, by what it is on twice the segments.
pub fn relative(coarse: f64, fine: f64) -> f64 {
    (coarse / fine - 1.0) / REST
}

/// Relative errors of the coarse results.
fn differences(coarse: &[Output], fine: &[Output]) -> Vec<f64> {
    let one = |(a, b): (&Output, &Output)| match (a.value.is_nan(), b.value.is_nan()) {
        (true, true) => 0.0,
        (false, false) if a.value == b.value => 0.0,
        (false, false) => (a.value - b.value) / (b.scale * REST),
        _ => f64::INFINITY,
    };
    coarse.iter().zip(fine).map(one).collect()
}

#[cfg(test)]
mod tests {
    //! The mesh holds the tolerance, the estimate is the error, and what contributes nothing stays as it is.
    use super::*;
    use bimorph_base::Bundle;
    use bimorph_netlist::load;

    /// Two beams whose errors fall with the fourth power: one a thousand times the other's.
    #[test]
    fn refines_where_it_matters() {
        let text = "process p = [Youngsmodulus=165e9 density=2300 h=2u]\nanchor p [a] []\nbeam2d p [a b] [l=100u w=2u]\n\
                    beam2d p [b c] [l=50u w=2u]\n";
        let structure = load(&Bundle::from_text("two.net", text), &[]).unwrap().structure;
        let error = |n: &[usize]| 1.0 * (n[0] as f64).powi(-4) + 1e-3 * (n[1] as f64).powi(-4);
        for tol in [1e-2, 1e-4, 1e-6] {
            let options = CompileOptions { tol, ..CompileOptions::default() };
            let mut meshes = 0;
            let mut analyse = |n: &[usize]| {
                meshes += 1;
                Ok::<_, ()>(vec![Output { value: 3.0 + error(n), scale: 1.0 }, Output { value: f64::NAN, scale: 1.0 }])
            };
            let order = fit(&structure, &options, vec![2, 2], &mut analyse).unwrap();
            let (found, reported) = (error(&order.segments), order.estimated_error.unwrap());
            assert!(found <= tol && (1.1..1.4).contains(&(reported / found)), "{tol}: {found} {reported}");
            assert!(order.segments[0] >= 2 * order.segments[1], "{:?}", order.segments);
            assert!(meshes <= 20, "{meshes}");
        }
    }

    /// Where rounding grows with the segments, the mesh is the best of those compared, with its own estimate: a beam whose error falls with
    /// the fourth power of its segments and rises with their square, which is least at 9.
    #[test]
    fn ends_where_rounding_begins() {
        let text =
            "process p = [Youngsmodulus=165e9 density=2300 h=2u]\nanchor p [a] []\nbeam2d p [a b] [l=100u w=2u]\n";
        let structure = load(&Bundle::from_text("one.net", text), &[]).unwrap().structure;
        let error = |n: usize| (n as f64).powi(-4) + 1e-6 * (n as f64).powi(2);
        let options = CompileOptions { tol: 1e-7, ..CompileOptions::default() };
        let mut analyse = |n: &[usize]| Ok::<_, ()>(vec![Output { value: 3.0 + error(n[0]), scale: 1.0 }]);
        let order = fit(&structure, &options, vec![2], &mut analyse).unwrap();
        let (found, reported) = (error(order.segments[0]), order.estimated_error.unwrap());
        assert!(order.segments[0] < 64 && found < 20.0 * error(9), "{found:e} with {:?}", order.segments);
        assert!(reported > options.errors().requested() && reported > 0.2 * found, "{reported:e} of {found:e}");
    }

    /// Results that do not converge are reported, and refinement stops.
    #[test]
    fn gives_up_where_segments_do_not_help() {
        let text =
            "process p = [Youngsmodulus=165e9 density=2300 h=2u]\nanchor p [a] []\nbeam2d p [a b] [l=100u w=2u]\n";
        let structure = load(&Bundle::from_text("one.net", text), &[]).unwrap().structure;
        let mut sign = 1.0;
        let mut analyse = |_: &[usize]| {
            sign = -sign;
            Ok::<_, ()>(vec![Output { value: sign, scale: 1.0 }])
        };
        let order = fit(&structure, &CompileOptions::default(), vec![2], &mut analyse).unwrap();
        assert!(order.estimated_error.unwrap() > 1.0 && order.segments[0] <= 64, "{order:?}");
    }
}
