//! State of a mechanism after a single overheating: its hot arms are shortened, see [`bimorph_domains::backbending`].
use super::statics::operating_point;
use super::{AnalysisError, PortVoltages};
use bimorph_domains::backbending::Strength;
use bimorph_model::compile::CompiledModel;
use bimorph_model::discretize::permanent_strain;
use bimorph_multibody::BodyMatrix;
use bimorph_multibody::forces::{RestStrain, add_offset_change, axial_change, axial_force};
use bimorph_multibody::planar::Pose;
use bimorph_solve::SolveError;
use nalgebra::{DMatrix, DVector};
use std::sync::Arc;

/// Steps in which the voltages are raised, since plastic strain depends on the path.
const STEPS: usize = 8;
/// MotionCorrections of the plastic strains in one step.
const CORRECTIONS: usize = 60;
/// Tolerance of the stress, relative to the cold strength: far below the error of any mesh.
const TOLERANCE: f64 = 1e-9;

/// Permanent strains of beams by name (1); negative: shorter.
pub type Strains = Vec<(String, f64)>;

/// A backbent mechanism.
#[derive(Debug, Clone)]
pub struct BackbentMechanism {
    /// The mechanism with its hot arms shortened.
    pub compiled: CompiledModel,
    /// Permanent strain of each beam that can yield (1), by name; negative: shorter.
    pub strains: Strains,
    /// Yield stress over Young's modulus of each (1): the scale of its strains.
    pub bearable: Vec<f64>,
}

/// A beam that can yield.
struct YieldingBeam {
    /// Index in the structure's yields.
    index: usize,
    beam: usize,
    heater: usize,
    strength: Strength,
    area: f64,
    joints: permanent_strain::YieldingJoints,
    /// Shortening so far (1).
    strain: f64,
}

/// Raises the ports to `voltages` once and lets the beams yield.
///
/// The voltages are raised in steps; in each the excess of the arms that yield is driven to zero by Newton's method, with the
/// stress that a shortening of one arm takes from every other. An arm whose strain would fall below what it was leaves.
///
/// # Errors
/// [`AnalysisError::BadRequest`] when no beam can yield; see [`AnalysisError`].
pub fn backbend(compiled: &CompiledModel, voltages: &PortVoltages) -> Result<BackbentMechanism, AnalysisError> {
    let mut arms = arms(compiled);
    if arms.is_empty() {
        return Err(AnalysisError::BadRequest {
            what: "backbending".into(),
            detail: "no heated beam can yield; give beam2det or its layer `yieldstress` and `softening`".into(),
        });
    }
    let mut bent = compiled.clone();
    for step in 1..=STEPS {
        let share = step as f64 / STEPS as f64;
        let now: Vec<(String, f64)> = voltages.iter().map(|(name, v)| (name.clone(), share * v)).collect();
        settle(&mut bent, &mut arms, &now)?;
    }
    let beams = &compiled.structure.beams;
    let strains = arms.iter().map(|a| (beams[a.beam].name.clone(), -a.strain)).collect();
    let bearable = arms.iter().map(|a| a.strength.cold / beams[a.beam].material.youngs_modulus).collect();
    Ok(BackbentMechanism { compiled: bent, strains, bearable })
}

fn arms(compiled: &CompiledModel) -> Vec<YieldingBeam> {
    let yields = &compiled.structure.yields;
    let joints = permanent_strain::arms(&compiled.parts, yields);
    (yields.iter().zip(joints).enumerate())
        .filter_map(|(index, (y, joints))| {
            let heater = compiled.parts.heaters.iter().position(|&beam| beam == y.beam)?;
            let beam = &compiled.structure.beams[y.beam];
            let ambient = beam.material.ambient_temperature;
            Some(YieldingBeam {
                index,
                beam: y.beam,
                heater,
                strength: Strength { cold: y.stress, ambient, softening: y.softening },
                area: beam.width * beam.thickness,
                joints,
                strain: -y.strain,
            })
        })
        .filter(|arm| !arm.joints.is_empty())
        .collect()
}

/// Finds the plastic strains at these voltages.
fn settle(bent: &mut CompiledModel, arms: &mut [YieldingBeam], voltages: &PortVoltages) -> Result<(), AnalysisError> {
    let floor: Vec<f64> = arms.iter().map(|a| a.strain).collect();
    for _ in 0..CORRECTIONS {
        let (excess, relief) = pressures(bent, arms, voltages)?;
        let yields = |k: &usize| excess[*k] > TOLERANCE * arms[*k].strength.cold || arms[*k].strain > floor[*k];
        let active: Vec<usize> = (0..arms.len()).filter(yields).collect();
        let worst = active.iter().map(|&k| excess[k].abs() / arms[k].strength.cold).fold(0.0, f64::max);
        if worst <= TOLERANCE {
            return Ok(());
        }
        let matrix = DMatrix::from_fn(active.len(), active.len(), |i, j| relief[(active[i], active[j])]);
        let wanted = DVector::from_fn(active.len(), |i, _| excess[active[i]]);
        let Some(change) = matrix.lu().solve(&wanted) else { break };
        for (&k, change) in active.iter().zip(change.iter()) {
            arms[k].strain = (arms[k].strain + change).max(floor[k]);
        }
        apply(bent, arms);
    }
    Err(AnalysisError::NotConverged { detail: "the plastic strains of the hot arms do not settle".into() })
}

/// By how much each arm's pressure exceeds its strength (Pa), and the pressure that a unit of shortening of each arm (column)
/// takes from each arm (row) (Pa).
fn pressures(
    bent: &CompiledModel,
    arms: &[YieldingBeam],
    voltages: &PortVoltages,
) -> Result<(Vec<f64>, DMatrix<f64>), AnalysisError> {
    let point = operating_point(bent, voltages)?;
    let system = &bent.parts.system;
    let model = &system.model;
    let mut drive = system.electrics.drive();
    system.electrics.apply(&point.sources, &point.rise, &mut drive);
    let rest = RestStrain { expansion: &drive.expansion, built_in: 1.0 };
    let mean = |arm: &YieldingBeam, force: &dyn Fn(usize) -> f64| {
        arm.joints.iter().map(|(k, _)| force(*k)).sum::<f64>() / (arm.joints.len() as f64 * arm.area)
    };
    let excess = (arms.iter())
        .map(|arm| {
            let pressure = -mean(arm, &|k| axial_force(model, &model.joints[k], &point.q, &rest));
            arm.strength.excess(pressure, arm.strength.ambient + point.rise[arm.heater])
        })
        .collect();
    let mut tangent = BodyMatrix::new(&model.pattern);
    let mut moved = point.q.clone();
    system.tangent(&point.q, &drive, &mut tangent, &mut moved);
    model.project_matrix(&mut tangent);
    tangent.factor_holding(&model.pattern, &mut Vec::new()).map_err(|p| SolveError::singular(system, p))?;
    let mut relief = DMatrix::zeros(arms.len(), arms.len());
    for (column, cause) in arms.iter().enumerate() {
        moved.fill(Pose::zeros());
        for &(k, length) in &cause.joints {
            // a rest offset that falls by `length`, as a load
            add_offset_change(model, &model.joints[k], &point.q, length, &mut moved);
        }
        model.project(&mut moved);
        tangent.solve(&model.pattern, &mut moved);
        for (row, arm) in arms.iter().enumerate() {
            let own = if row == column {
                mean(arm, &|k| {
                    let section = model.section(&model.joints[k]);
                    section.stiffness.0[0] * section.expansion.map_or(0.0, |(_, length)| length)
                })
            } else {
                0.0
            };
            relief[(row, column)] = own + mean(arm, &|k| axial_change(model, &model.joints[k], &point.q, &moved));
        }
    }
    Ok((excess, relief))
}

fn apply(bent: &mut CompiledModel, arms: &[YieldingBeam]) {
    for arm in arms {
        let before = std::mem::replace(&mut Arc::make_mut(&mut bent.structure).yields[arm.index].strain, -arm.strain);
        permanent_strain::strain(&mut bent.parts, &arm.joints, -arm.strain - before);
    }
}
