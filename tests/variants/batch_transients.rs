//! Batched transients: a lane has the bits of its variant alone.

use bimorph::analysis::transient::first_step;
use bimorph::compile::{CompileOptions, CompiledModel, compile};
use bimorph::domains::Ramp;
use bimorph::equations::Bodies;
use bimorph::netlist::{Bundle, Setting, read_bundle};
use bimorph::options::ErrorBudget;
use bimorph::solve::time::adaptive::{Adaptive, Control};
use bimorph::solve::time::batch::{self, BatchRun, Ended, Watcher};
use bimorph::solve::time::method::Motion;
use bimorph::solve::time::rodas4::Rodas4;

/// The final motion and the accepted steps of a run.
type Ran = (Vec<(f64, f64)>, Motion);

/// Notes every step.
#[derive(Default)]
struct Notes(Vec<(f64, f64)>);

impl Watcher for Notes {
    fn wants(&self, _: f64, _: f64) -> bool {
        true
    }
    fn observe(&mut self, s: f64, h: f64, _: &Motion, _: &Motion) -> bool {
        self.0.push((s, h));
        true
    }
}

/// A run alone.
fn alone(compiled: &CompiledModel, volts: &[f64], stop: f64, tol: f64) -> Option<Ran> {
    let system = &compiled.parts.system;
    let mut sources = vec![0.0; system.electrics.sources()];
    system.electrics.fill_sources(&volts[..system.electrics.ports], &mut sources);
    let rise = vec![0.0; system.electrics.heating.states()];
    let ramp = Ramp::new(&system.electrics, &sources, &sources, &rise, stop);
    let mut motion = Motion::zeros(system.bodies());
    let (mut steps, mut h) = (Vec::new(), first_step(system, stop));
    let mut driver = Adaptive::new(system.bodies(), Rodas4::new(system, &[]));
    let control = Control::Tolerance(tol);
    let ended =
        driver.advance(&mut Bodies::new(system, &ramp), &mut motion, &mut h, control, usize::MAX, &mut |s, h, _, _| {
            steps.push((s, h));
            true
        });
    ended.ok().map(|_| (steps, motion))
}

/// The same runs in a batch.
fn together(variants: &[CompiledModel], volts: &[f64], stop: f64, tol: f64) -> Vec<Option<Ran>> {
    let electrics: Vec<_> = variants.iter().map(|v| &v.parts.system.electrics).collect();
    let sources: Vec<Vec<f64>> = (electrics.iter())
        .map(|e| {
            let mut sources = vec![0.0; e.sources()];
            e.fill_sources(&volts[..e.ports], &mut sources);
            sources
        })
        .collect();
    let rises: Vec<Vec<f64>> = electrics.iter().map(|e| vec![0.0; e.heating.states()]).collect();
    let mut notes: Vec<Notes> = variants.iter().map(|_| Notes::default()).collect();
    let mut ends: Vec<Option<Motion>> = variants.iter().map(|_| None).collect();
    let errors = ErrorBudget::of(tol);
    {
        let mut queue = variants.iter().zip(&mut notes).enumerate();
        let mut next = || {
            let (number, (variant, notes)) = queue.next()?;
            let system = &variant.parts.system;
            let (volts, rise) = (&sources[number], &rises[number]);
            let ramp = Ramp::new(&system.electrics, volts, volts, rise, stop);
            let motion = Motion::zeros(system.bodies());
            Some((number, BatchRun { system, ramp, motion, h: first_step(system, stop), errors, watcher: notes }))
        };
        let mut done = |number: usize, ended: Ended| {
            if let Ended::Done(motion, _) = ended {
                ends[number] = Some(motion);
            }
        };
        let work = batch::advance(&variants[0].parts.system, &mut next, &mut done);
        assert!(work.together < work.accepted + work.rejected, "nothing was side by side: {work:?}");
    }
    notes.into_iter().zip(ends).map(|(notes, end)| Some((notes.0, end?))).collect()
}

fn bits(ran: &Ran) -> Vec<u64> {
    let (steps, Motion { q, v }) = ran;
    let motion = q.iter().chain(v).flat_map(|p| [p.x, p.y, p.z]);
    steps.iter().flat_map(|&(s, h)| [s, h]).chain(motion).map(f64::to_bits).collect()
}

/// In a batch a run has the steps and the bits of a single run, for any neighbours. The cases are variants with many
/// steps beside some with few, contact, dampers, supports, heat, a comb, and loads. One cannot be stepped at all (a
/// mass of 1e-300 kg), and one of another topology is left to a single run. Eleven variants in eight lanes.
#[test]
fn a_lane_has_the_bits_of_its_variant_alone() {
    let bank = std::fs::read_to_string("examples/bank/bank.net").expect("the bank");
    let bundle = |text: &str| {
        let mut bundle = read_bundle(std::path::Path::new("examples/bank/bank.net"), &[]).expect("the bank");
        let root = bundle.root.clone();
        *bundle.files.get_mut(&root).expect("its root") = text.to_owned();
        bundle
    };
    let bank = bundle(&bank.replace("pitch = 49.5u", "param pitch = 49.5u"));
    let plate = "param m=1e-10, k=1, c=2e-6, F=1u
process p = [Youngsmodulus=165e9 density=2300 h=2u viscosity=1.8e-5 fluid=2u]
anchor * [f] [l=1u w=1u h=1u]
mass2d * [m] [m=m]
guide2d * [m] []
spring2d * [f m] [kx=k]
damper2d * [f m] [bx=c]
anchor * [e] [l=1u w=1u h=1u]
plategap2d * [m e] [A=1e-8 gap=2u]
eground * [e] []
anchor p [a] []
arm beam2d p [a t] [l=100u w=2u oz=deg(20)]
tip beam2d p [t u] [l=50u w=2u oz=deg(70)]
f2d * [t] [F=F oz=deg(60)]
drive port * [m e] []
";
    let plate = Bundle::from_text("plate.net", plate);
    let grid = |bundle: &Bundle, names: [&str; 2], values: &dyn Fn(usize) -> [f64; 2]| -> Vec<CompiledModel> {
        let options = |k: usize| {
            let pairs = names.iter().zip(values(k));
            let set = pairs.map(|(name, value)| ((*name).to_owned(), Setting::Number(value))).collect();
            CompileOptions { set, ..CompileOptions::default() }
        };
        (0..11).map(|k| compile(bundle, &options(k)).expect("a variant")).collect()
    };
    let arms = |k: usize| [1.8e-6 + 0.04e-6 * k as f64, 48e-6 + 0.3e-6 * k as f64];
    let mut banks = grid(&bank, ["wh", "pitch"], &arms);
    let other = CompileOptions { set: vec![("comb".into(), Setting::Number(0.0))], ..CompileOptions::default() };
    banks[5] = compile(&bank, &other).expect("without its comb");
    // the last of these closes its gap, and one hardly has a mass
    let masses = |k: usize| [if k == 3 { 1e-300 } else { 0.5e-10 + 0.3e-10 * k as f64 }, 1e-6 * k as f64];
    let plates = grid(&plate, ["m", "F"], &masses);
    for (name, variants, volts, stop, odd) in
        [("bank", &banks, [2.2, 1.0], 4e-6, vec![5]), ("plate", &plates, [5.5, 0.0], 6e-5, vec![])]
    {
        let volts = &volts;
        let one: Vec<_> = variants.iter().map(|v| alone(v, volts, stop, 1e-5)).collect();
        let run = together(variants, volts, stop, 1e-5);
        let steps: Vec<usize> = one.iter().flatten().map(|ran| ran.0.len()).collect();
        assert!(steps.iter().max() > steps.iter().min(), "{name}: all alike {steps:?}");
        for (number, (lane, alone)) in run.iter().zip(&one).enumerate() {
            match (lane, alone) {
                (Some(lane), Some(alone)) => {
                    assert_eq!(lane.0.len(), alone.0.len(), "{name} {number}");
                    assert!(bits(lane) == bits(alone), "{name} {number}");
                    assert!(!odd.contains(&number));
                }
                (None, _) => assert!(odd.contains(&number) || alone.is_none(), "{name} {number} has no lane"),
                (Some(_), None) => panic!("{name} {number} ends in a lane and not alone"),
            }
        }
    }
}
