//! Any text is read to its end: no panic, no hang, messages that can be shown, a drawing without infinities, and the same one each time.
//!
//! Texts are those of this repository and some of here, changed at random: words exchanged, lines lost, doubled and mixed, numbers made extreme,
//! bytes thrown in. A few hundred of each language run with every test; `make fuzz` runs them for minutes.

use bimorph::netlist::{Bundle, load};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// No text may take more processor time than this, with a release build: the largest that limits allow take two or three seconds, twice.
const LONGEST: Duration = Duration::from_secs(15);
/// Texts with every test, of each language.
const QUICK: usize = 300;

/// Netlists of SUGAR 2 that hold what the examples do not.
const SUGAR2: [&str; 3] = [
    "process p1 = [Youngsmodulus=160e9 density=2000 h=2u viscosity=2e-5 fluid=1u thermalexpansion=3e-6 sheetresistance=20 thermcond=30]\n\
     param n = 3, w = 2u\nanchor p1 [a e] [l=1u w=1u]\nsemicircularbeam p1 [a b] [radius=100u alpha=pi/2 w=w L1=-5u oz1=pi/4]\n\
     predisplacedbeam4 p1 [b c] [l=100u w=2u qx2=-10u qy2=20u qoz1=0.1]\nfreehinge p1 [c d] [l=50u w=4u]\nslider2 p1 [d f] [l=10u w=1u slideroz=1]\n\
     trapezoidalbeam p1 [d e] [l=40u wtop=2u wbottom=6u h=4u]\ntaper2d p1 [a g] [l=100u w1=6u w2=w]\nsoftjointlr p1 [g h] [l=9u w=1u]\n\
     prestressedbeam p1 [a b] [l=100u w=2u qx=1n qy=2n qoz=1]\nrigidlinkbeam p1 [h i] [l=10u w=1u L2=5u oz2=-pi/2]\n",
    "process p1 = [Youngsmodulus=160e9 density=2000 h=2u]\nsubnet s [p q] [oz=* l=10u k=?] [ for i=1:3 [ beam2d parent [p m(i)] [l=l*i w=1u oz=i] ]\n\
     if isdef(k) [ beam2d parent [m(1) q] [l=k w=1u] ] else beam2d parent [m(3) q] [l=l w=1u] ]\ns p1 [a b] [oz=1.5]\nx s p1 [b c] [oz=0 k=3u]\nanchor p1 [a] []\n\
     beam3d p1 [a b] [l=100u w=2u oy=1]\nbeam3dlink p1 [a d] [l=2u w=10u h=10u oy=pi/2 L1=5u oy1=-pi/2]\n",
    "eground * [g] []\nVsrc * [n g] [sv=2 sph=pi/2]\nresistor * [n m] [len=30u R=55 oz=-pi/2 L2=10u oz2=pi/2]\nshort * [m s] [len=2u]\nground * [s e] [len=1u]\n\
     mass2d * [m2] [m=1e-10]\nspring2d * [f m2] [kx=1]\nanchor * [f] []\nplategap2d * [m2 f2] [A=1e-8 gap=2u]\nanchor * [f2] []\nport * [m2 f2] []\nstop2d * [m2] [gap=1u]\n\
     call print(1, 'a')\ncall assert(1 == 1, 'no')\n",
];

/// Netlists of SUGAR 3.
const SUGAR3: [&str; 2] = [
    "-- a\npoly = material {Youngsmodulus=160e9, density=2300}\np1 = material {parent=poly, h=2u}\nn = n or 3\nif not w then w = 2u end\n\
     subnet leg(top, foot, material, l, w)\n  local knee = node \"knee\"\n  w = w or 2u\n  beam2d {top, knee; material=material, l=l, w=w, oz=90}\n\
     beam2d {knee, foot; material=material, l=l/2, w=w}\n  anchor {foot; material=material, l=5u, w=5u}\nend\n\
     for k = 1, n do beam2d {node {name=\"c_\"..k}, node {name=\"c_\"..(k + 1)}, p1; l=10u, w=w} end\n\
     leg {node \"c_1\", node \"f\"; material=p1, l=40u, oz=30, name=\"x\"}\nf2d {node \"c_2\"; F=1u, oz=-90}\nt = {3, 4; a=1}\nfor k, v in t do print(k, v) end\n",
    "use(\"std2cvt.net\")\nuse 'stdlib.net'\np1 = material {Youngsmodulus=165e9, density=2300, h=2u}\nsubnet mfh (L, R, material, top, w)\n  local parent = material\n\
     _currnodes[\"L\"] = L\n  w = w or (2u) or (material and material.w)\n  mfbeam3d {_n(\"q\"), _n(\"L\"); material = parent, l = (top)/(3), w = w, oz = -(deg(90))}\nend\n\
     mfanchor {_n(\"A\"); material = p1}\nmfh {_n(\"A\"), _n(\"b\"); material = p1, top = 90u, oz = deg(180)}\nR {_n(\"A\"), _n(\"b\"); R = 100}\n\
     A2 = node {0, 0, 0; name=\"z\"}\nelement {A2; model=\"force\", x=1u}\nassert(isdef(p1), \"none\")\nx = sin(1) + max(1, 2) + mod(5, 3)\nrelpos_treewalk()\n",
];

/// Words that mean something, and numbers at the ends of their range.
const WORDS: [&str; 62] = [
    "[",
    "]",
    "(",
    ")",
    "{",
    "}",
    "=",
    ";",
    ",",
    "*",
    "?",
    "%",
    "--",
    "\n",
    "'",
    "\"",
    "..",
    "~=",
    "^",
    "-",
    "0",
    "1e308",
    "-1e308",
    "1e-320",
    "9e99E",
    "1e9",
    "-5u",
    "0.5",
    "nan",
    "pi",
    "oz",
    "oy=1",
    "ox=pi/2",
    "l=0",
    "w=-1u",
    "h=1e9",
    "alpha=7",
    "radius=1n",
    "L1=-1",
    "N=0",
    "gap=1n",
    "parent",
    "subnet",
    "process",
    "param",
    "for",
    "if",
    "else",
    "uses t.net",
    "use('t.net')",
    "end",
    "do",
    "function",
    "local",
    "while",
    "nil",
    "and",
    "node",
    "element",
    "material",
    "beam3dlink",
    "anchor",
];

struct Maker {
    random: ChaCha8Rng,
    corpus: Vec<String>,
}

impl Maker {
    fn below(&mut self, most: usize) -> usize {
        (self.random.next_u64() % most.max(1) as u64) as usize
    }

    /// A boundary of a character of `text`.
    fn place(&mut self, text: &str) -> usize {
        let mut at = self.below(text.len() + 1);
        while !text.is_char_boundary(at) {
            at -= 1;
        }
        at
    }

    /// A stretch of `text` of at most `most` bytes.
    fn stretch(&mut self, text: &str, most: usize) -> (usize, usize) {
        let start = self.place(text);
        let mut end = (start + self.below(most)).min(text.len());
        while !text.is_char_boundary(end) {
            end += 1;
        }
        (start, end)
    }

    fn line(&mut self, text: &str) -> String {
        let lines: Vec<&str> = text.split_inclusive('\n').collect();
        let at = self.below(lines.len());
        lines.get(at).map_or(String::new(), |line| (*line).to_owned())
    }

    fn text(&mut self) -> String {
        let at = self.below(self.corpus.len());
        let mut text = self.corpus[at].clone();
        for _ in 0..1 + self.below(8) {
            let other = self.below(self.corpus.len());
            let other = self.corpus[other].clone();
            match self.below(9) {
                0 | 1 => {
                    let (start, end) = self.stretch(&text, 12);
                    let word = WORDS[self.below(WORDS.len())];
                    text.replace_range(start..end, word);
                }
                2 => {
                    let at = self.place(&text);
                    let word = format!(" {} ", WORDS[self.below(WORDS.len())]);
                    text.insert_str(at, &word);
                }
                3 => {
                    let at = self.place(&text);
                    let line = self.line(&other);
                    text.insert_str(at, &line);
                }
                4 => {
                    let (start, end) = self.stretch(&text, 80);
                    text.replace_range(start..end, "");
                }
                5 => {
                    let (start, end) = self.stretch(&text, 200);
                    let again = text[start..end].repeat(1 + self.below(20));
                    text.insert_str(end, &again);
                }
                6 => {
                    let digits: Vec<usize> =
                        text.char_indices().filter(|(_, c)| c.is_ascii_digit()).map(|(at, _)| at).collect();
                    if !digits.is_empty() {
                        let at = digits[self.below(digits.len())];
                        let number = format!("{}e{}", self.below(10), self.below(620) as i64 - 310);
                        text.replace_range(at..=at, &number);
                    }
                }
                7 => {
                    let at = self.place(&text);
                    let odd = char::from_u32(self.random.next_u32() % 0x300).unwrap_or('\u{feff}');
                    text.insert(at, odd);
                }
                _ => {
                    let (start, end) = self.stretch(&other, 300);
                    let at = self.place(&text);
                    text.insert_str(at, &other[start..end]);
                }
            }
            if text.len() > 100_000 {
                let end = (0..=100_000).rev().find(|&at| text.is_char_boundary(at)).unwrap_or(0);
                text.truncate(end);
            }
        }
        text
    }
}

/// Reads a text as a netlist that includes itself under no name; answers whether it loads.
fn read(text: &str) -> bool {
    let bundle = Bundle::from_text("fuzz.net", text).with_file("t.net", text);
    match load(&bundle, &[]) {
        Ok(loaded) => {
            drop(loaded.warnings.render(false));
            let places = loaded.structure.nodes.iter().flat_map(|node| node.position);
            assert!(places.clone().all(f64::is_finite), "a node lies nowhere");
            let sizes = loaded.structure.beams.iter().flat_map(|b| [b.length, b.width, b.thickness]);
            assert!(sizes.clone().all(|x| x > 0.0 && x.is_finite()), "a beam without size");
            let again = load(&bundle, &[]).expect("it loaded a moment ago");
            assert_eq!(again.structure, loaded.structure, "another drawing each time");
            true
        }
        Err(diagnostics) => {
            assert!(diagnostics.has_errors(), "refused without an error");
            drop(diagnostics.render(true));
            false
        }
    }
}

/// Runs a language from its texts until `done`; answers how many texts were read.
fn run(corpus: Vec<String>, seed: u64, mut done: impl FnMut(usize) -> bool) {
    let mut maker = Maker { random: ChaCha8Rng::seed_from_u64(seed), corpus };
    let (mut count, mut loaded) = (0, 0);
    while !done(count) {
        let text = maker.text();
        let start = processor_time();
        match catch_unwind(AssertUnwindSafe(|| read(&text))) {
            Ok(true) => {
                loaded += 1;
                // what loads is a better start than what does not
                if maker.corpus.len() < 2000 && text.len() < 20_000 {
                    maker.corpus.push(text.clone());
                }
            }
            Ok(false) => {}
            Err(fault) => {
                eprintln!("seed {seed}, text {count}:\n{text}");
                resume_unwind(fault);
            }
        }
        let took = processor_time().saturating_sub(start);
        assert!(took < LONGEST, "seed {seed}, text {count} took {took:?}:\n{text}");
        count += 1;
    }
    println!("{count} texts, {loaded} of them load");
    assert!(loaded > 0, "no text loads: nothing is tried");
}

/// Of this thread, where the system provides it; otherwise zero.
fn processor_time() -> Duration {
    let text = fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    Duration::from_nanos(text.split_whitespace().next().and_then(|word| word.parse().ok()).unwrap_or(0))
}

fn netlists(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder").flatten() {
        let path = entry.path();
        if path.is_dir() {
            netlists(&path, found);
        } else if path.extension().is_some_and(|e| e == "net") {
            found.push(path);
        }
    }
}

fn sugar2() -> Vec<String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut files = Vec::new();
    for folder in ["examples", "tests/netlists", "tests/decks"] {
        netlists(&root.join(folder), &mut files);
    }
    files.sort();
    let texts = files.iter().filter_map(|file| fs::read_to_string(file).ok()).filter(|text| text.len() < 8_000);
    texts.chain(SUGAR2.map(str::to_owned)).collect()
}

fn sugar3() -> Vec<String> {
    SUGAR3.map(str::to_owned).into()
}

#[test]
fn a_few_sugar2() {
    run(sugar2(), 1, |count| count >= QUICK);
}

#[test]
#[cfg(feature = "lua")]
fn a_few_sugar3() {
    run(sugar3(), 1, |count| count >= QUICK);
}

/// For `FUZZ_MINUTES` (min), each time with other texts: the seed is the time, and is printed on failure.
fn for_minutes(corpus: Vec<String>) {
    let minutes: f64 = std::env::var("FUZZ_MINUTES").ok().and_then(|text| text.parse().ok()).unwrap_or(10.0);
    let end = Instant::now() + Duration::from_secs_f64(60.0 * minutes);
    let seed = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).map_or(0, |d| d.as_secs());
    run(corpus, seed, |_| Instant::now() > end);
}

#[test]
#[ignore = "minutes: make fuzz"]
fn fuzz_sugar2() {
    for_minutes(sugar2());
}

#[test]
#[ignore = "minutes: make fuzz"]
#[cfg(feature = "lua")]
fn fuzz_sugar3() {
    for_minutes(sugar3());
}
