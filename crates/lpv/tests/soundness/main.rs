//! The project's own attack on the word `proved`: thousands of generated loops, good, bad and at the edge, are given
//! to the prover, and every verdict is held against exact arithmetic, against flights from the edge of each proved
//! set, and against the motion of each witness.
//!
//! ```text
//! cargo test -p lpv --test soundness
//! SOUNDNESS_REPLAY=linear:17 cargo test -p lpv --test soundness     # one case, with its claims
//! SOUNDNESS_SHARE=0.1 cargo test -p lpv --test soundness            # a tenth, up to the first disagreement
//! ```
//!
//! Cases are numbered from 0, and a number gives the same case everywhere. The table counts claims by verdict; a case
//! is `refused` where the door or the prover takes it for no design.

mod conditions;
mod exact;
mod flight;
mod kinds;
mod loops;
mod numbers;

use kinds::Kind;
use numbers::Numbers;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Instant;

/// Disagreements that are printed.
const MOST_PRINTED: usize = 20;
/// What a whole run has at least.
const LEAST_CASES: usize = 10_000;
const LEAST_FLIGHTS: usize = 2_000;

/// What came out of the cases of a kind.
#[derive(Clone, Copy, Debug, Default)]
pub struct Tally {
    /// How many.
    pub cases: usize,
    /// Claims that are proved.
    pub proved: usize,
    /// Claims that are neither.
    pub undecided: usize,
    /// Claims that are refuted.
    pub refuted: usize,
    /// Cases that are taken for no design.
    pub refused: usize,
    /// Flights from the edge of a proved set.
    pub flights: usize,
    /// Refutations that were evaluated.
    pub witnesses: usize,
    /// The claims of the case are printed.
    pub is_replay: bool,
}

impl Tally {
    /// Count the verdicts.
    pub fn count(&mut self, claims: &[lpv::certificate::Claim]) {
        use lpv::certificate::Verdict;
        for claim in claims {
            match claim.verdict {
                Verdict::Proved => self.proved += 1,
                Verdict::Refuted => self.refuted += 1,
                _ => self.undecided += 1,
            }
            if self.is_replay {
                println!("{}: {} ({})", claim.verdict.word(), claim.claim, claim.detail);
            }
        }
    }

    fn add(&mut self, other: &Self) {
        self.cases += other.cases;
        self.proved += other.proved;
        self.undecided += other.undecided;
        self.refuted += other.refuted;
        self.refused += other.refused;
        self.flights += other.flights;
        self.witnesses += other.witnesses;
    }

    fn line(&self, name: &str) -> String {
        let Self { cases, proved, undecided, refuted, refused, flights, witnesses, .. } = self;
        format!(
            "{name:<12} {cases:>7} {proved:>8} {undecided:>10} {refuted:>8} {refused:>8} {flights:>8} {witnesses:>10}"
        )
    }
}

/// One case; a panic is a disagreement too.
fn run(number: usize, kind: &Kind, case: u64, is_replay: bool) -> (Tally, Result<(), String>) {
    let mut tally = Tally { cases: 1, is_replay, ..Tally::default() };
    let mut numbers = Numbers::new(number, case);
    let attempt = std::panic::AssertUnwindSafe(|| (kind.run)(&mut numbers, &mut tally));
    let result = std::panic::catch_unwind(attempt).unwrap_or_else(|panic| {
        let text = panic.downcast_ref::<String>().map(String::as_str).or(panic.downcast_ref::<&str>().copied());
        Err(format!("panics: {}", text.unwrap_or("without a word")))
    });
    (tally, result)
}

fn replay(text: &str) -> Result<(), String> {
    let (name, case) = text.split_once(':').ok_or("SOUNDNESS_REPLAY is KIND:NUMBER")?;
    let number = kinds::KINDS.iter().position(|kind| kind.name == name).ok_or(format!("no kind is called {name}"))?;
    let case: u64 = case.parse().map_err(|_| format!("{case} is no number of a case"))?;
    let (tally, result) = run(number, &kinds::KINDS[number], case, true);
    println!("{tally:?}");
    result
}

fn main() {
    // a filter that does not name this suite leaves it out, as it does with other tests
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let filters: Vec<&String> = arguments.iter().filter(|argument| !argument.starts_with('-')).collect();
    if arguments.iter().any(|argument| argument == "--list")
        || !filters.is_empty() && !filters.iter().any(|f| "soundness".contains(f.as_str()))
    {
        return;
    }
    exact::check();
    #[cfg(feature = "mutants")]
    if arguments.iter().any(|argument| argument == "--mutants") {
        return mutants();
    }
    if let Ok(text) = std::env::var("SOUNDNESS_REPLAY") {
        match replay(&text) {
            Ok(()) => println!("{text}: nothing disagrees"),
            Err(reason) => {
                eprintln!("{text}: {reason}");
                std::process::exit(1);
            }
        }
        return;
    }
    let share: Option<f64> =
        std::env::var("SOUNDNESS_SHARE").ok().map(|text| text.parse().expect("SOUNDNESS_SHARE is a number"));
    std::process::exit(attack(share));
}

/// Print the names of the prover's defects; each has a hook, and each hook is in the table.
#[cfg(feature = "mutants")]
fn mutants() {
    fn hooks(folder: &std::path::Path, names: &mut std::collections::BTreeSet<String>) {
        for entry in std::fs::read_dir(folder).expect("the sources") {
            let path = entry.expect("a file").path();
            if path.is_dir() {
                hooks(&path, names);
            } else {
                let text = std::fs::read_to_string(&path).expect("a source");
                let name = |part: &str| part.split('"').next().unwrap_or_default().to_owned();
                names.extend(text.split("mutant::is(\"").skip(1).map(name));
            }
        }
    }
    let mut found = std::collections::BTreeSet::new();
    hooks(&std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("src"), &mut found);
    let known: std::collections::BTreeSet<String> = lpv::mutant::TABLE.iter().map(|(name, _)| (*name).into()).collect();
    assert_eq!(found, known, "hooks and table differ");
    lpv::mutant::TABLE.iter().for_each(|(name, what)| println!("{name}\t{what}"));
}

/// Run all cases, or a share of each kind; the exit code.
fn attack(share: Option<f64>) -> i32 {
    let started = Instant::now();
    let count = |kind: &Kind| ((kind.cases as f64 * share.unwrap_or(1.0)).ceil() as u64).max(1);
    // evenly mixed, so that an early end has seen something of every kind
    let mut cases: Vec<(f64, usize, u64)> = (kinds::KINDS.iter().enumerate())
        .flat_map(|(number, kind)| (0..count(kind)).map(move |case| (case as f64 / count(kind) as f64, number, case)))
        .collect();
    cases.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let (next, stop) = (AtomicUsize::new(0), AtomicBool::new(false));
    let tallies = Mutex::new(vec![(Tally::default(), 0.0); kinds::KINDS.len()]);
    let disagreements = Mutex::new(Vec::<(usize, u64, String)>::new());
    let hook = std::panic::take_hook();
    std::panic::set_hook(Box::new(|_| {}));
    let work = || {
        // each case on one thread: they are small
        let inline = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build();
        let _inline = inline.expect("a pool of this thread");
        while let Some(&(_, number, case)) = cases.get(next.fetch_add(1, Ordering::Relaxed)) {
            if stop.load(Ordering::Relaxed) {
                return;
            }
            let begun = Instant::now();
            let (tally, result) = run(number, &kinds::KINDS[number], case, false);
            {
                let mut tallies = tallies.lock().expect("no thread panics");
                tallies[number].0.add(&tally);
                tallies[number].1 += begun.elapsed().as_secs_f64();
            }
            if let Err(reason) = result {
                disagreements.lock().expect("no thread panics").push((number, case, reason));
                stop.fetch_or(share.is_some(), Ordering::Relaxed);
            }
        }
    };
    let threads = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    std::thread::scope(|scope| {
        for _ in 0..threads {
            std::thread::Builder::new().stack_size(16 << 20).spawn_scoped(scope, work).expect("a thread");
        }
    });
    std::panic::set_hook(hook);
    let (tallies, mut disagreements) =
        (tallies.into_inner().expect("whole"), disagreements.into_inner().expect("whole"));
    println!("kind           cases   proved  undecided  refuted  refused  flights  witnesses");
    let mut all = Tally::default();
    for (kind, (tally, seconds)) in kinds::KINDS.iter().zip(&tallies) {
        println!("{}   {seconds:.1} s", tally.line(kind.name));
        all.add(tally);
    }
    println!("{}   {:.1} s on {threads} threads", all.line("all"), started.elapsed().as_secs_f64());
    disagreements.sort();
    for (number, case, reason) in disagreements.iter().take(MOST_PRINTED) {
        let name = kinds::KINDS[*number].name;
        println!("disagreement: {reason}\n  SOUNDNESS_REPLAY={name}:{case} cargo test -p lpv --test soundness");
    }
    if !disagreements.is_empty() {
        println!("{} cases disagree", disagreements.len());
        return 1;
    }
    // otherwise the suite tests nothing
    let is_idle = |(kind, (tally, _)): (&Kind, &(Tally, f64))| (tally.proved == 0).then_some(kind.name);
    let idle: Vec<&str> = kinds::KINDS.iter().zip(&tallies).filter_map(is_idle).collect();
    if share.is_none() && (all.cases < LEAST_CASES || all.flights < LEAST_FLIGHTS || !idle.is_empty()) {
        println!("too little was tested: {} cases, {} flights, nothing proved of {idle:?}", all.cases, all.flights);
        return 1;
    }
    0
}
