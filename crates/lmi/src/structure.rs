//! Matrix unknowns found again in a problem that is given coefficient by coefficient.
//!
//! In `AY + YAᵀ` the scalar unknown Yᵢⱼ has the coefficient `aᵢeⱼᵀ + eⱼaᵢᵀ + aⱼeᵢᵀ + eᵢaⱼᵀ`: two stars, of rows and columns i and j, with
//! the same few vectors aᵢ in all coefficients. A coefficient matrix is written as `Σ_c (g e_cᵀ + e_c gᵀ)` over a set of at most two
//! centres c that meet all its entries; the vectors g go to a library. Where that can be done in several ways the one whose vectors are
//! in the library already is taken. Vectors and centres then span grids whose entries are unknowns: the [`Stack`]s that
//! expressions come with. Where no coefficient matrix shares its vectors with others there is no structure, and none is made up.

use crate::factored::{NO_UNKNOWN, Stack};
use crate::sparse::Coefficients;
use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};

/// Grids filled less than this are not worth their empty places.
const LEAST_FILL: f64 = 0.3;
/// A sum of two parts may differ from the entry in the file by this many units of rounding.
const ROUNDINGS: f64 = 4.0;

/// A sparse vector by rising index.
type Vector = Vec<(usize, f64)>;

/// Sum of hashes of the entries: what is left without one of them is a difference away.
fn hash(vector: &[(usize, f64)]) -> u64 {
    vector.iter().fold(0, |sum, entry| sum.wrapping_add(hash_of_entry(*entry)))
}

/// Well mixed by two rounds of multiplication and shift.
fn hash_of_entry((index, value): (usize, f64)) -> u64 {
    let mixed = (index as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ value.to_bits();
    let mixed = (mixed ^ (mixed >> 32)).wrapping_mul(0xD6E8_FEB8_6659_FD93);
    (mixed ^ (mixed >> 32)).wrapping_mul(0xD6E8_FEB8_6659_FD93)
}

/// The same bits, entry by entry.
fn same<'a>(a: impl Iterator<Item = &'a (usize, f64)>, b: &[(usize, f64)]) -> bool {
    a.map(|(i, value)| (*i, value.to_bits())).eq(b.iter().map(|(i, value)| (*i, value.to_bits())))
}

/// The vectors that coefficients share.
#[derive(Default)]
struct Library {
    vectors: Vec<Vector>,
    /// By their hashes.
    whole: HashMap<u64, Vec<usize>, Hashed>,
    /// By the index of an entry, and the hash of what is left without it: the vector and the place of the entry.
    without: HashMap<u64, Vec<(usize, usize)>, Hashed>,
}

/// Keys are hashes themselves.
type Hashed = BuildHasherDefault<Same>;

#[derive(Default)]
struct Same(u64);

impl Hasher for Same {
    fn finish(&self) -> u64 {
        self.0
    }

    fn write(&mut self, bytes: &[u8]) {
        bytes.iter().for_each(|byte| self.0 = self.0.rotate_left(8) ^ u64::from(*byte));
    }

    fn write_u64(&mut self, key: u64) {
        self.0 = key;
    }
}

/// Of an index and the hash of the rest.
fn with_index(index: usize, rest: u64) -> u64 {
    rest.rotate_left(1) ^ hash_of_entry((index, 0.0))
}

impl Library {
    fn find(&self, vector: &[(usize, f64)]) -> Option<usize> {
        let same_hash = self.whole.get(&hash(vector))?;
        same_hash.iter().copied().find(|&id| same(self.vectors[id].iter(), vector))
    }

    fn insert(&mut self, vector: &[(usize, f64)]) -> usize {
        if let Some(id) = self.find(vector) {
            return id;
        }
        let (id, all) = (self.vectors.len(), hash(vector));
        self.whole.entry(all).or_default().push(id);
        for (at, entry) in vector.iter().enumerate() {
            let rest = all.wrapping_sub(hash_of_entry(*entry));
            self.without.entry(with_index(entry.0, rest)).or_default().push((id, at));
        }
        self.vectors.push(vector.to_vec());
        id
    }

    /// Vectors that are `vector` but for an entry at `index`, with that entry.
    fn completions<'a>(
        &'a self,
        vector: &'a [(usize, f64)],
        index: usize,
    ) -> impl Iterator<Item = (usize, f64)> + Clone + 'a {
        let whole = self.find(vector).map(|id| (id, 0.0));
        let others = self.without.get(&with_index(index, hash(vector))).into_iter().flatten();
        let fits = move |&&(id, at): &&(usize, usize)| {
            let candidate = &self.vectors[id];
            candidate[at].0 == index && same(candidate[..at].iter().chain(&candidate[at + 1..]), vector)
        };
        whole.into_iter().chain(others.filter(fits).map(|&(id, at)| (id, self.vectors[id][at].1)))
    }
}

/// One coefficient matrix and the ways to cover it.
struct Coefficient<'a> {
    unknown: usize,
    entries: &'a [(usize, usize, f64)],
    /// Centres that meet all entries alone.
    stars: Vec<usize>,
    /// Pairs of centres that do.
    pairs: Vec<[usize; 2]>,
}

/// `g e_cᵀ + e_c gᵀ` of one unknown, g in the library.
struct Term {
    vector: usize,
    centre: usize,
    unknown: usize,
}

/// The stacks of a block with these coefficients, each with entries (row, column, value), row ≥ column; `None` where they have no
/// structure to speak of.
pub(crate) fn stacks(n: usize, coefficients: &Coefficients) -> Option<Vec<Stack>> {
    let mut open = Vec::with_capacity(coefficients.len());
    for (unknown, entries) in coefficients {
        let coefficient = Coefficient::new(*unknown, entries)?;
        open.push(coefficient);
    }
    let mut library = Library::default();
    let mut popularity = vec![0_usize; n];
    let mut terms = Vec::new();
    let mut partners = [Vector::new(), Vector::new()];
    // What can be read in one way only comes first.
    open.retain(|c| match c.stars[..] {
        [centre] => {
            let vector = library.insert(c.partner(centre, None, &mut partners[0]));
            popularity[centre] += 1;
            terms.push(Term { vector, centre, unknown: c.unknown });
            false
        }
        _ => true,
    });
    let enough = |library: &Library| library.vectors.len() <= 8 + coefficients.len() / 2;
    while !open.is_empty() && enough(&library) {
        let before = open.len();
        open.retain(|c| match c.found(&library, &mut partners) {
            Some(found) => {
                terms.extend(found.into_iter().flatten());
                false
            }
            None => true,
        });
        if open.len() == before {
            terms.extend(open.remove(0).new_terms(&mut library, &popularity, &mut partners[0]).into_iter().flatten());
        }
    }
    if enough(&library) { grids(n, &library, &terms) } else { None }
}

impl<'a> Coefficient<'a> {
    /// `None` where more than two centres are needed.
    fn new(unknown: usize, entries: &'a [(usize, usize, f64)]) -> Option<Self> {
        let &(row, column, _) = entries.first()?;
        let (mut stars, mut pairs) = (Vec::new(), Vec::new());
        let ends = [row, column];
        for &first in if row == column { &ends[..1] } else { &ends } {
            let mut rest = entries.iter().filter(|e| e.0 != first && e.1 != first);
            let Some(&(row, column, _)) = rest.next() else {
                stars.push(first);
                continue;
            };
            for second in [row, column] {
                let pair = [first.min(second), first.max(second)];
                if rest.clone().all(|e| e.0 == second || e.1 == second) && !pairs.contains(&pair) {
                    pairs.push(pair);
                }
            }
        }
        if stars.len() == 2 {
            pairs.push([row.min(column), row.max(column)]);
        }
        (!stars.is_empty() || !pairs.is_empty()).then_some(Self { unknown, entries, stars, pairs })
    }

    /// g of the centre, without its entry at `other`, in the memory given.
    fn partner<'b>(&self, centre: usize, other: Option<usize>, vector: &'b mut Vector) -> &'b [(usize, f64)] {
        let meets = self.entries.iter().filter_map(|&(row, column, value)| match (row == centre, column == centre) {
            (true, true) => Some((row, 0.5 * value)),
            (true, false) => Some((column, value)),
            (false, true) => Some((row, value)),
            (false, false) => None,
        });
        vector.clear();
        vector.extend(meets.filter(|(i, _)| Some(*i) != other));
        // No two entries are at the same place.
        vector.sort_unstable_by_key(|(i, _)| *i);
        vector
    }

    /// The entry at the crossing of two centres.
    fn crossing(&self, [low, high]: [usize; 2]) -> f64 {
        self.entries.iter().find(|e| (e.0, e.1) == (high, low)).map_or(0.0, |e| e.2)
    }

    /// Terms whose vectors are all in the library.
    fn found(&self, library: &Library, [low_memory, high_memory]: &mut [Vector; 2]) -> Option<[Option<Term>; 2]> {
        let Self { unknown, .. } = *self;
        for &[low, high] in &self.pairs {
            let sum = self.crossing([low, high]);
            let of_high = library.completions(self.partner(high, Some(low), high_memory), low);
            if of_high.clone().next().is_none() {
                continue;
            }
            let of_low = library.completions(self.partner(low, Some(high), low_memory), high);
            for (vector, a) in of_low {
                for (other, b) in of_high.clone() {
                    if (sum - a - b).abs() <= ROUNDINGS * f64::EPSILON * (a.abs() + b.abs()) {
                        let first = Term { vector, centre: low, unknown };
                        return Some([Some(first), Some(Term { vector: other, centre: high, unknown })]);
                    }
                }
            }
        }
        let star = |&centre: &usize| {
            let vector = library.find(self.partner(centre, None, low_memory))?;
            Some([Some(Term { vector, centre, unknown }), None])
        };
        self.stars.iter().find_map(star)
    }

    /// Terms with new vectors, around the centres that are met most.
    fn new_terms(&self, library: &mut Library, popularity: &[usize], memory: &mut Vector) -> [Option<Term>; 2] {
        let Self { unknown, .. } = *self;
        let most = self.stars.iter().copied().max_by_key(|&c| (popularity[c], std::cmp::Reverse(c)));
        if let Some(centre) = most {
            let vector = library.insert(self.partner(centre, None, memory));
            return [Some(Term { vector, centre, unknown }), None];
        }
        let popular = |pair: &[usize; 2]| popularity[pair[0]] + popularity[pair[1]];
        let Some(&[low, high]) = self.pairs.iter().max_by_key(|pair| popular(pair)) else {
            return [None, None];
        };
        let first = library.insert(self.partner(low, None, memory));
        let second = library.insert(self.partner(high, Some(low), memory));
        [Some(Term { vector: first, centre: low, unknown }), Some(Term { vector: second, centre: high, unknown })]
    }
}

/// Grids of vectors and centres, one for each connected part.
fn grids(n: usize, library: &Library, terms: &[Term]) -> Option<Vec<Stack>> {
    // Union by the smallest centre.
    let mut part: Vec<usize> = (0..n).collect();
    let find = |part: &[usize], mut c: usize| {
        while part[c] != c {
            c = part[c];
        }
        c
    };
    let mut centre_of: Vec<Option<usize>> = vec![None; library.vectors.len()];
    for term in terms {
        let root = find(&part, term.centre);
        match centre_of[term.vector] {
            None => centre_of[term.vector] = Some(root),
            Some(other) => {
                let other = find(&part, other);
                part[root.max(other)] = root.min(other);
            }
        }
    }
    let mut stacks = Vec::new();
    for root in (0..n).filter(|&c| part[c] == c) {
        let mut left: Vec<&Term> = terms.iter().filter(|t| find(&part, t.centre) == root).collect();
        // A place that two unknowns want is given to one; the other goes to a further grid.
        while !left.is_empty() {
            let (stack, rest) = grid(n, library, &left)?;
            stacks.push(stack);
            left = rest;
        }
    }
    Some(stacks)
}

/// One grid, and the terms that found their place taken; `None` where it is nearly empty.
fn grid<'a>(n: usize, library: &Library, terms: &[&'a Term]) -> Option<(Stack, Vec<&'a Term>)> {
    let sorted = |of: fn(&Term) -> usize| {
        let mut all: Vec<usize> = terms.iter().map(|t| of(t)).collect();
        all.sort_unstable();
        all.dedup();
        all
    };
    let centres = sorted(|t| t.centre);
    // In the order in which the unknowns come, so that their places run on.
    let mut vectors: Vec<usize> = Vec::new();
    let mut by_unknown: Vec<&Term> = terms.to_vec();
    by_unknown.sort_by_key(|t| (t.unknown, t.centre));
    for term in &by_unknown {
        if !vectors.contains(&term.vector) {
            vectors.push(term.vector);
        }
    }
    let mut positions = vec![NO_UNKNOWN; vectors.len() * centres.len()];
    let mut rest = Vec::new();
    let mut filled = 0;
    for &term in terms {
        let row = vectors.iter().position(|&v| v == term.vector)?;
        let column = centres.binary_search(&term.centre).ok()?;
        let place = &mut positions[row * centres.len() + column];
        if *place == NO_UNKNOWN {
            *place = term.unknown;
            filled += 1;
        } else {
            rest.push(term);
        }
    }
    if (filled as f64) < LEAST_FILL * positions.len() as f64 {
        return None;
    }
    let dense = |vector: &[(usize, f64)]| {
        let mut out = vec![0.0; n];
        vector.iter().for_each(|&(i, value)| out[i] = value);
        out
    };
    let u = vectors.iter().map(|&v| dense(&library.vectors[v])).collect();
    let v = centres.iter().map(|&c| dense(&[(c, 1.0)])).collect();
    Some((Stack { u, v, positions }, rest))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assembly::Assembly;
    use crate::block::{Block, DenseBlock};
    use crate::factored::Factored;
    use crate::sparse::{Entry, Sparse, merge};
    use proptest::prelude::*;

    /// Coefficients of Yᵢⱼ and Lᵢⱼ in [AY + YAᵀ + BL + LᵀBᵀ, Y, Lᵀ; Y, 0, 0; L, 0, 0].
    fn regulator(n: usize, m: usize, a: &[f64], b: &[f64]) -> (usize, Vec<Entry>) {
        let size = 2 * n + m;
        let mut entries = Vec::new();
        let mut unknown = 0;
        let mut add = |unknown: usize, i: usize, j: usize, value: f64| {
            let (row, column) = (i.max(j), i.min(j));
            if value != 0.0 {
                entries.push(Entry { unknown, row, column, value: if i == j { 2.0 * value } else { value } });
            }
        };
        // u vᵀ + v uᵀ with v a unit vector.
        let mut star = |unknown: usize, u: &[f64], centre: usize| {
            u.iter().enumerate().for_each(|(i, &value)| add(unknown, i, centre, value));
        };
        let a_column = |i: usize| {
            let mut u = vec![0.0; size];
            (0..n).for_each(|k| u[k] = a[k + i * n]);
            u[n + i] = 1.0;
            u
        };
        for i in 0..n {
            for j in 0..=i {
                star(unknown, &a_column(i), j);
                if i != j {
                    star(unknown, &a_column(j), i);
                }
                unknown += 1;
            }
        }
        for i in 0..m {
            let mut u = vec![0.0; size];
            (0..n).for_each(|k| u[k] = b[k + i * n]);
            u[2 * n + i] = 1.0;
            for j in 0..n {
                star(unknown, &u, j);
                unknown += 1;
            }
        }
        (size, entries)
    }

    fn check(size: usize, entries: Vec<Entry>, unknowns: usize, stacks: Vec<Stack>) {
        let constant = || vec![0.0; size * size];
        let (sparse, factored) = (Sparse::new(size, entries), Factored::new(size, stacks));
        let forms = [
            DenseBlock { size, constant: constant(), factored: Factored::default(), sparse },
            DenseBlock { size, constant: constant(), factored, sparse: Sparse::default() },
        ];
        let x: Vec<f64> = (0..unknowns).map(|k| ((7 * k + 3) % 11) as f64 - 5.0).collect();
        let symmetric = |seed: usize| -> Vec<f64> {
            let entry = |i: usize, j: usize| ((i.max(j) * 5 + i.min(j) * 3 + seed) % 13) as f64 / 4.0 - 1.5;
            (0..size * size).map(|at| entry(at % size, at / size)).collect()
        };
        let results = forms.map(|form| {
            let blocks = [Block::Dense(form)];
            let block = &blocks[0];
            let mut scratch = block.scratch(unknowns);
            let mut value = vec![0.0; size * size];
            block.apply(&x, &mut value, &mut scratch);
            let mut adjoint = vec![0.0; unknowns];
            block.adjoint(1.5, &symmetric(1), &mut adjoint, &mut scratch);
            let mut complement = vec![0.0; unknowns * unknowns];
            let mut assembly = Assembly::new(&blocks);
            let matrices = [symmetric(2), symmetric(3)];
            let [p, z] = &matrices;
            block.schur(0, [p, z], &mut assembly, &mut complement, unknowns, &mut scratch);
            assembly.add(&mut complement, unknowns);
            [value, adjoint, complement]
        });
        for (a, b) in results[0].iter().zip(&results[1]) {
            let scale = 1.0 + a.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
            a.iter().zip(b).for_each(|(a, b)| assert!((a - b).abs() <= 1e-12 * scale, "{a} {b}"));
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        /// Dense and sparse A: the same operator; from the columns of A and B where they are dense.
        #[test]
        fn regulators_are_recovered(
            n in 1..6_usize,
            m in 1..4_usize,
            values in prop_oneof![
                prop::collection::vec(prop_oneof![Just(0.0), Just(0.0), -2.0..2.0_f64], 40),
                prop::collection::vec(0.1..2.0_f64, 40),
            ],
        ) {
            let (size, entries) = regulator(n, m, &values[..n * n], &values[n * n..n * n + n * m]);
            let unknowns = n * (n + 1) / 2 + n * m;
            let stacks = stacks(size, &merge(entries.clone())).expect("a structure");
            // Columns with few entries can be read in several ways; more vectors than there are do no harm.
            if values[..n * n + n * m].iter().all(|value| *value != 0.0) {
                prop_assert_eq!(stacks.iter().map(|s| s.u.len()).sum::<usize>(), n + m);
            }
            check(size, entries, unknowns, stacks);
        }

        /// Whatever the entries: nothing or the same operator.
        #[test]
        fn nothing_is_made_up(
            entries in prop::collection::vec((0..6_usize, 0..5_usize, 0..5_usize, prop_oneof![Just(1.0), -2.0..2.0_f64]), 1..25),
        ) {
            let entry = |&(unknown, i, j, value): &(usize, usize, usize, f64)| {
                Entry { unknown, row: i.max(j), column: i.min(j), value }
            };
            let entries: Vec<Entry> = entries.iter().map(entry).collect();
            if let Some(stacks) = stacks(5, &merge(entries.clone())) {
                check(5, entries, 6, stacks);
            }
        }
    }
}
