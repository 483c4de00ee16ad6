//! Fewer points of gaps with the same forces.
//!
//! Gaps along beams have hundreds of points of integration, between which the few shapes of a reduced model hardly change. Of a field some of
//! them stay, with non-negative weights by least squares: capacitance and forces over the coordinates at sampled states are those of all. Points
//! of contact and of films become sums of neighbours at their mean approach, so that no part of a gap is left without contact. These sums are finer where
//! parts press on each other in a sampled state.
//! Weights are factors of capacitance, area and damping, so that charge and force still come from one energy.
//!
//! References: C. Lawson, R. Hanson, "Solving least squares problems" (1974), chapter 23; C. Farhat and others, "Dimensional reduction of
//! nonlinear finite element dynamic models", Int. J. Numer. Methods Eng. 98 (2014), for weights of reduced models.

use super::Approaches;
use super::monomials::Monomials;
use super::shapes::MemberPoints;
use bimorph_base::ErrorBudget;
use bimorph_domains::capacitor::Capacitor;
use bimorph_domains::{Law, PointLaw};
use nalgebra::{DMatrix, DVector, SVD};

/// Points of a kind up to which all of them stay.
const FEW: usize = 12;
/// Points of films of all gaps of a group, and of contact of those parts that press on each other in no state.
const NEIGHBOURS: usize = 32;
/// Points of contact of the parts that do.
const PRESSED: usize = 32;
/// Most points of a field.
const MOST: usize = 60;
/// Weight that counts as 0 (1).
const NONE: f64 = 1e-12;

/// Kinds of points.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum PointKind {
    Field,
    Contact,
    Film,
    Other,
}

fn kind(law: &PointLaw) -> PointKind {
    match (&law.law, law.film) {
        (Some(Law::Field(capacitor, None)), None) if capacitor.acts() => PointKind::Field,
        (Some(Law::Field(capacitor, Some(_))), None) if !capacitor.acts() => PointKind::Contact,
        (None, Some(_)) => PointKind::Film,
        _ => PointKind::Other,
    }
}

/// Area, capacitance or damping for which a point stands.
fn extent(law: &PointLaw) -> f64 {
    match (&law.law, law.film) {
        (Some(Law::Field(_, Some(contact))), _) => contact.area,
        (_, Some((_, film))) => film.strength,
        _ => 1.0,
    }
}

/// The law of `weight` such points.
fn times(law: &PointLaw, weight: f64) -> PointLaw {
    let scaled = law.law.map(|law| match law {
        Law::Field(Capacitor::Plates { strength, edges, gap, shortening, closest }, contact) => {
            let strength = strength * weight;
            let contact = contact.map(|mut contact| {
                contact.area *= weight;
                contact
            });
            Law::Field(Capacitor::Plates { strength, edges, gap, shortening, closest }, contact)
        }
        other => other,
    });
    PointLaw { law: scaled, film: law.film.map(|(drawn, film)| (drawn, film.part(weight))), ..*law }
}

/// A point with its share of each shape.
type MixedPoint = (PointLaw, DVector<f64>);

/// The same approaches with fewer points. Members of a group have one voltage and become one; `states` are coordinates of states.
pub(super) fn thinned(
    all: &Approaches,
    groups: &[Vec<usize>],
    states: &[Vec<f64>],
    monomials: &Monomials,
    errors: ErrorBudget,
) -> Approaches {
    let mut members = Vec::new();
    let mut rows: Vec<DVector<f64>> = Vec::new();
    for group in groups {
        let of: Vec<&MemberPoints> = all.members.iter().filter(|points| group.contains(&points.member)).collect();
        let Some(first) = of.first() else { continue };
        let points: Vec<(usize, MixedPoint)> = of
            .iter()
            .flat_map(|points| {
                let (member, first) = (points.member, points.first);
                points.laws.iter().enumerate().map(move |(k, law)| {
                    let row: DVector<f64> = all.mix.row(first + k).transpose();
                    (member, (*law, row))
                })
            })
            .collect();
        let mut kept: Vec<MixedPoint> = Vec::new();
        for wanted in [PointKind::Field, PointKind::Contact, PointKind::Film, PointKind::Other] {
            let chosen: Vec<&(usize, MixedPoint)> = points.iter().filter(|(_, (law, _))| kind(law) == wanted).collect();
            kept.extend(match wanted {
                PointKind::Field if chosen.len() > FEW => {
                    let of: Vec<&MixedPoint> = chosen.iter().map(|(_, point)| point).collect();
                    weighted(&of, all, states, monomials, errors.reduced_field())
                }
                PointKind::Contact | PointKind::Film if chosen.len() > NEIGHBOURS => {
                    let values: Vec<_> = states.iter().map(|x| all.shapes.values(&monomials.values(x))).collect();
                    joined(&chosen, |(law, row)| {
                        wanted == PointKind::Contact && values.iter().any(|at| law.at(row.dot(at), 0.0).force > 0.0)
                    })
                }
                _ => chosen.into_iter().map(|(_, point)| point.clone()).collect(),
            });
        }
        members.push(MemberPoints {
            member: first.member,
            merged: of.iter().map(|points| points.member).collect(),
            first: rows.len(),
            laws: kept.iter().map(|(law, _)| *law).collect(),
        });
        rows.extend(kept.into_iter().map(|(_, row)| row));
    }
    let count = all.shapes.coefficients.nrows();
    let mix = DMatrix::from_fn(rows.len(), count, |k, l| rows[k][l]);
    Approaches { members, shapes: all.shapes.clone(), mix }
}

/// Neighbours of one member as one point each, with their mean approach: those that press together, and the others.
fn joined(points: &[&(usize, MixedPoint)], presses: impl Fn(&MixedPoint) -> bool) -> Vec<MixedPoint> {
    let pressed: Vec<_> = points.iter().map(|point| (presses(&point.1), *point)).collect();
    let of_kind = |which: bool| pressed.iter().filter(|(pressed, _)| *pressed == which).count();
    let (pressing, apart) = (of_kind(true), of_kind(false));
    let mut found = Vec::new();
    for of in pressed.chunk_by(|(a, one), (b, other)| a == b && one.0 == other.0) {
        let (most, all) = if of[0].0 { (PRESSED, pressing) } else { (NEIGHBOURS, apart) };
        let of: Vec<_> = of.iter().map(|(_, point)| *point).collect();
        let count = (most * of.len()).div_ceil(all).min(of.len());
        for part in 0..count {
            let part = &of[part * of.len() / count..(part + 1) * of.len() / count];
            let whole: f64 = part.iter().map(|(_, (law, _))| extent(law)).sum();
            let mut row = part[0].1.1.clone() * 0.0;
            part.iter().for_each(|(_, (law, of))| row += of * (extent(law) / whole));
            let law = &part[0].1.0;
            found.push((times(law, whole / extent(law)), row));
        }
    }
    found
}

/// Some points of a field with weights that give the capacitance and the forces of all, to a relative error of `least` at the states.
fn weighted(
    points: &[&MixedPoint],
    all: &Approaches,
    states: &[Vec<f64>],
    monomials: &Monomials,
    least: f64,
) -> Vec<MixedPoint> {
    let (n, m) = (points.len(), monomials.size);
    let mut table = DMatrix::zeros(states.len() * (m + 1), n);
    for (s, x) in states.iter().enumerate() {
        bimorph_base::budget::check();
        let values = all.shapes.values(&monomials.values(x));
        let slopes = all.shapes.derivatives(&monomials.derivatives(x));
        let mut block = DMatrix::zeros(m + 1, n);
        for (k, (law, row)) in points.iter().enumerate() {
            let u = row.dot(&values);
            // at a volt the force is half of the slope of the capacitance
            let pull = -2.0 * law.at(u, 1.0).force;
            block[(0, k)] = law.capacitance(&[u]);
            block.view_mut((1, k), (m, 1)).copy_from(&(slopes.tr_mul(row) * pull));
        }
        // capacitance and forces count alike
        for (first, count) in [(0, 1), (1, m)] {
            let part = block.rows(first, count).into_owned();
            let size = part.column_sum().norm();
            if size > 0.0 {
                table.rows_mut(s * (m + 1) + first, count).copy_from(&(part / size));
            }
        }
    }
    let whole = table.column_sum();
    let weights = non_negative(&table, &whole, least);
    weights.into_iter().map(|(k, weight)| (times(&points[k].0, weight), points[k].1.clone())).collect()
}

/// Columns with non-negative weights whose sum comes within the fraction `least` of `b`.
fn non_negative(a: &DMatrix<f64>, b: &DVector<f64>, least: f64) -> Vec<(usize, f64)> {
    let mut active: Vec<(usize, f64)> = Vec::new();
    let norms: Vec<f64> = (0..a.ncols()).map(|k| a.column(k).norm().max(f64::MIN_POSITIVE)).collect();
    let mut left = b.clone();
    for _ in 0..3 * MOST {
        if left.norm() <= least * b.norm() || active.len() >= MOST {
            break;
        }
        let gain = a.tr_mul(&left);
        let free = (0..a.ncols()).filter(|k| active.iter().all(|(of, _)| of != k));
        let Some(next) = free.max_by(|i, j| (gain[*i] / norms[*i]).total_cmp(&(gain[*j] / norms[*j]))) else { break };
        if gain[next] <= 0.0 {
            break;
        }
        active.push((next, 0.0));
        loop {
            let columns: Vec<DVector<f64>> = active.iter().map(|(k, _)| a.column(*k).into_owned()).collect();
            let solved = SVD::new(DMatrix::from_columns(&columns), true, true).solve(b, NONE);
            let Ok(wanted) = solved else { return active };
            let step = (active.iter().zip(wanted.iter()))
                .filter(|(_, to)| **to <= NONE)
                .map(|((_, from), to)| from / (from - to).max(f64::MIN_POSITIVE))
                .fold(1.0, f64::min);
            active.iter_mut().zip(wanted.iter()).for_each(|((_, w), to)| *w += step * (to - *w));
            if step == 1.0 {
                break;
            }
            active.retain(|(_, w)| *w > NONE);
            if active.is_empty() {
                break;
            }
        }
        left = active.iter().fold(b.clone(), |left, (k, w)| left - a.column(*k) * *w);
    }
    active.sort_by_key(|(k, _)| *k);
    active
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Integrals of 1, s, …, s⁵ over 200 points of the unit interval are those of few of them with positive weights to 1e-9, as Gauss' rule of three
    /// points has them.
    #[test]
    fn few_points_integrate_polynomials() {
        let n = 200;
        let table = DMatrix::from_fn(6, n, |i, k| ((k as f64 + 0.5) / n as f64).powi(i as i32) / n as f64);
        let whole = table.column_sum();
        let found = non_negative(&table, &whole, 1e-9);
        assert!(found.len() <= 6 && found.iter().all(|(_, w)| *w > 0.0), "{found:?}");
        let sum = found.iter().fold(DVector::zeros(6), |sum, (k, w)| sum + table.column(*k) * *w);
        assert!((sum - &whole).norm() <= 1e-9 * whole.norm());
    }
}
