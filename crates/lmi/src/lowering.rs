//! From expressions to the solver's form: every block as `C + Σ_g (U_g X_g V_gᵀ + V_g X_gᵀ U_gᵀ)`.
//!
//! A symmetric block F equals ½(F + Fᵀ), so that a term `U X V` stands for `½(U X V + Vᵀ Xᵀ Uᵀ)`. Terms whose unknowns meet
//! the same right factor are stacked, `U₁ X₁ Vᵀ + U₂ X₂ Vᵀ = [U₁ U₂] [X₁; X₂] Vᵀ`; in `AY + YAᵀ − BL − LᵀBᵀ` and most
//! LMIs of control that leaves one stack per block.

use crate::block::{Block, DenseBlock, DiagonalBlock, Program};
use crate::combination::{Combinations, Part};
use crate::dense::{axpy, dot};
use crate::expression::{Expr, Shape, Term, Unknown};
use crate::factored::{Factored, Stack};
use crate::problem::{Inequality, Sense};
use crate::sparse::{Entry, Sparse};
use crate::{Error, Mat, Options, verification};

/// Where the scalars of each matrix unknown stand in the vector x: a rectangular unknown row by row, of a symmetric
/// one the lower triangle row by row.
#[derive(Debug)]
pub(crate) struct Layout {
    unknowns: Vec<Unknown>,
    starts: Vec<usize>,
    len: usize,
}

impl Layout {
    pub fn new(unknowns: &[Unknown]) -> Self {
        let mut len = 0;
        let mut starts = Vec::with_capacity(unknowns.len());
        for unknown in unknowns {
            starts.push(len);
            len += if unknown.symmetric { unknown.rows * (unknown.rows + 1) / 2 } else { unknown.rows * unknown.cols };
        }
        Self { unknowns: unknowns.to_vec(), starts, len }
    }

    /// Number of scalar unknowns.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Position of entry (i, j) of an unknown.
    pub fn position(&self, unknown: Unknown, i: usize, j: usize) -> usize {
        let start = self.starts[unknown.index];
        if unknown.symmetric {
            let (i, j) = if i >= j { (i, j) } else { (j, i) };
            start + i * (i + 1) / 2 + j
        } else {
            start + i * unknown.cols + j
        }
    }

    /// The first scalar of an unknown, and how many it has.
    fn scalars_of(&self, unknown: Unknown) -> (usize, usize) {
        let start = self.starts[unknown.index];
        (start, self.starts.get(unknown.index + 1).unwrap_or(&self.len) - start)
    }

    /// The unknowns as matrices.
    pub fn matrices(&self, x: &[f64]) -> Vec<Mat<f64>> {
        let entry = |unknown: Unknown| move |i, j| x[self.position(unknown, i, j)];
        self.unknowns.iter().map(|&u| Mat::from_fn(u.rows, u.cols, entry(u))).collect()
    }

    /// The scalars of matrices, symmetric where their unknowns are.
    pub fn values(&self, matrices: &[Mat<f64>]) -> Vec<f64> {
        let mut out = vec![0.0; self.len];
        for (&unknown, matrix) in self.unknowns.iter().zip(matrices) {
            for i in 0..unknown.rows {
                for j in 0..unknown.cols {
                    out[self.position(unknown, i, j)] = matrix[(i, j)];
                }
            }
        }
        out
    }

    /// From a gradient with respect to each matrix to the gradient with respect to x: the entries (i, j) and (j, i) of
    /// a symmetric unknown are one scalar.
    pub fn scalars(&self, gradients: &[Mat<f64>]) -> Vec<f64> {
        let mut out = vec![0.0; self.len];
        for (&unknown, gradient) in self.unknowns.iter().zip(gradients) {
            for i in 0..unknown.rows {
                for j in 0..unknown.cols {
                    out[self.position(unknown, i, j)] += gradient[(i, j)];
                }
            }
        }
        out
    }
}

/// A problem in the solver's form, margins not yet subtracted, with what is needed to read its answer.
#[derive(Debug)]
pub(crate) struct Lowered {
    pub program: Program,
    pub layout: Layout,
    /// Margin imposed on each inequality.
    pub margins: Vec<f64>,
    pub objective_constant: f64,
    /// 1 to minimise, −1 to maximise: objective = constant + sign · cᵀx.
    pub sign: f64,
}

/// Checks the problem and brings it into the solver's form.
pub(crate) fn lower(
    problem: u64,
    unknowns: &[Unknown],
    inequalities: &[Inequality],
    objective: Option<&(Sense, Expr)>,
    options: &Options,
) -> Result<Lowered, Error> {
    if inequalities.is_empty() {
        return Err(Error::NoConstraint);
    }
    let layout = Layout::new(unknowns);
    check_size(layout.len())?;
    let mut blocks = Vec::with_capacity(inequalities.len());
    let mut margins = Vec::with_capacity(inequalities.len());
    for inequality in inequalities {
        let place = format!("inequality \"{}\"", inequality.name);
        check_expression(problem, &place, &inequality.expression)?;
        check_symmetric(inequality, &layout)?;
        let margin = inequality.margin.unwrap_or(options.default_margin(&inequality.expression.constant));
        if !margin.is_finite() {
            return Err(Error::NotFinite { place: format!("the margin of {place}"), row: 0, column: 0, value: margin });
        }
        blocks.push(lower_block(&inequality.expression, &layout));
        margins.push(margin);
    }
    let (mut c, mut objective_constant, mut sign) = (vec![0.0; layout.len()], 0.0, 1.0);
    if let Some((sense, expression)) = objective {
        check_expression(problem, "the objective", expression)?;
        if (expression.nrows(), expression.ncols()) != (1, 1) {
            return Err(Error::ObjectiveNotScalar { rows: expression.nrows(), columns: expression.ncols() });
        }
        sign = if *sense == Sense::Minimize { 1.0 } else { -1.0 };
        objective_constant = expression.constant[(0, 0)];
        let mut gradients: Vec<Mat<f64>> = unknowns.iter().map(|u| Mat::zeros(u.rows, u.cols)).collect();
        let one = Mat::from_fn(1, 1, |_, _| sign);
        for term in expression.terms.iter() {
            gradients[term.unknown.index] += verification::gradient(term, &one);
        }
        c = layout.scalars(&gradients);
    }
    let program = Program { omega: 1.0, balanced: false, scale: vec![1.0; c.len()], objective: c, blocks, warm: None };
    Ok(Lowered { program, layout, margins, objective_constant, sign })
}

/// The Schur complement of this many unknowns takes 3.2 GB.
const MOST_UNKNOWNS: usize = 20_000;

pub(crate) fn check_size(unknowns: usize) -> Result<(), Error> {
    if unknowns > MOST_UNKNOWNS {
        return Err(Error::TooLarge { unknowns, allowed: MOST_UNKNOWNS });
    }
    Ok(())
}

fn check_expression(problem: u64, place: &str, expression: &Expr) -> Result<(), Error> {
    if expression.terms.iter().any(|term| term.unknown.problem != problem) {
        return Err(Error::ForeignUnknown { place: place.to_owned() });
    }
    let parts = expression.terms.iter().flat_map(|term| match &term.shape {
        Shape::Product { left, right, .. } => [left, right],
        Shape::Scaled { weights, matrix } => [weights, matrix],
    });
    for matrix in std::iter::once(&*expression.constant).chain(parts) {
        for column in 0..matrix.ncols() {
            for row in 0..matrix.nrows() {
                let value = matrix[(row, column)];
                if !value.is_finite() {
                    return Err(Error::NotFinite { place: place.to_owned(), row, column, value });
                }
            }
        }
    }
    Ok(())
}

/// A linear map vanishes when it vanishes at a generic point: the known part and two fixed, patternless points are
/// compared with their mirror images.
fn check_symmetric(inequality: &Inequality, layout: &Layout) -> Result<(), Error> {
    let expression = &inequality.expression;
    let (rows, columns) = (expression.nrows(), expression.ncols());
    if rows != columns {
        return Err(Error::NotSquare { name: inequality.name.clone(), rows, columns });
    }
    let mut next = patternless();
    if rows <= MOST_PROBED && surely_symmetric(expression, layout, &mut next) {
        return Ok(());
    }
    for probe in 0..3 {
        let x: Vec<f64> = (0..layout.len()).map(|_| if probe == 0 { 0.0 } else { next() }).collect();
        let values = layout.matrices(&x);
        let (mut worst, mut at, mut scale) = (0.0_f64, (0, 0), 0.0_f64);
        let mut f = (*expression.constant).clone();
        scale = scale.max(verification::largest_entry(&f));
        for term in expression.terms.iter() {
            let value = term.evaluate(&values[term.unknown.index]);
            scale = scale.max(verification::largest_entry(&value));
            f += value;
        }
        for j in 0..columns {
            for i in 0..j {
                let difference = (f[(i, j)] - f[(j, i)]).abs();
                if difference > worst {
                    (worst, at) = (difference, (i, j));
                }
            }
        }
        if worst > 1e-9 * scale {
            return Err(Error::NotSymmetric {
                name: inequality.name.clone(),
                row: at.0,
                column: at.1,
                difference: worst,
            });
        }
    }
    Ok(())
}

/// Numbers in (−½, ½) without pattern, the same each time.
fn patternless() -> impl FnMut() -> f64 {
    let mut seed = 0x9E37_79B9_7F4A_7C15_u64;
    move || {
        seed ^= seed << 13;
        seed ^= seed >> 7;
        seed ^= seed << 17;
        (seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    }
}

/// Whether the known part is symmetric and, at patternless u, v and X, `uᵀFv = vᵀFu` to rounding: products with vectors only. Where it is
/// not, the matrices themselves have to be looked at; where it is, an entry differs from its mirror image by less than what they are
/// held to.
fn surely_symmetric(expression: &Expr, layout: &Layout, next: &mut impl FnMut() -> f64) -> bool {
    let n = expression.nrows();
    let constant = &expression.constant;
    if (0..n).any(|j| (0..j).any(|i| constant[(i, j)] != constant[(j, i)])) {
        return false;
    }
    let x: Vec<f64> = (0..layout.len()).map(|_| next()).collect();
    let values = layout.matrices(&x);
    let [u, v] = [(); 2].map(|()| (0..n).map(|_| next()).collect::<Vec<f64>>());
    let (mut difference, mut magnitude) = (0.0, 0.0);
    for term in expression.terms.iter() {
        let x = &values[term.unknown.index];
        let (there, back) = match &term.shape {
            Shape::Product { left, transposed, right } => {
                let [lu, lv] = [&u, &v].map(|w| row_times(w, left));
                let [ru, rv] = [&u, &v].map(|w| times_column(right, w));
                let form = |l: &[f64], r: &[f64]| if *transposed { bilinear(r, x, l) } else { bilinear(l, x, r) };
                (form(&lu, &rv), form(&lv, &ru))
            }
            Shape::Scaled { weights, matrix } => {
                let factor = crate::expression::inner_product(weights, x);
                (factor * bilinear(&u, matrix, &v), factor * bilinear(&v, matrix, &u))
            }
        };
        difference += there - back;
        magnitude += there.abs() + back.abs();
    }
    difference.abs() <= PROBED * magnitude
}

/// Largest block that is probed, and the relative difference that rounding leaves: together they find what exceeds the tolerance on entries.
const MOST_PROBED: usize = 100;
const PROBED: f64 = 3e-14;

/// wᵀM.
fn row_times(w: &[f64], m: &Mat<f64>) -> Vec<f64> {
    (0..m.ncols()).map(|j| dot(w, m.col_as_slice(j))).collect()
}

/// M w.
fn times_column(m: &Mat<f64>, w: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; m.nrows()];
    w.iter().enumerate().for_each(|(j, w)| axpy(*w, m.col_as_slice(j), &mut out));
    out
}

/// aᵀMb.
fn bilinear(a: &[f64], m: &Mat<f64>, b: &[f64]) -> f64 {
    b.iter().enumerate().map(|(j, b)| b * dot(a, m.col_as_slice(j))).sum()
}

fn lower_block(expression: &Expr, layout: &Layout) -> Block {
    let n = expression.nrows();
    let mut constant = vec![0.0; n * n];
    for j in 0..n {
        for i in 0..n {
            constant[i + j * n] = 0.5 * (expression.constant[(i, j)] + expression.constant[(j, i)]);
        }
    }
    let mut entries = Vec::new();
    let mut products = Vec::new();
    for term in expression.terms.iter() {
        match &term.shape {
            Shape::Scaled { weights, matrix } => scaled_entries(term.unknown, weights, matrix, layout, &mut entries),
            Shape::Product { .. } => products.push(Product::of(term)),
        }
    }
    let gathered = gather(products);
    let combined = if n > 1 { combine(&gathered, layout) } else { None };
    if let Some((stacks, combinations)) = combined {
        let factored = Factored::of_combinations(n, stacks, Some(combinations));
        return Block::Dense(DenseBlock { size: n, constant, factored, sparse: Sparse::new(n, entries) });
    }
    let stacks = stack(gathered, layout);
    if n == 1 {
        let mut row: Vec<(usize, f64)> = entries.iter().map(|e: &Entry| (e.unknown, e.value)).collect();
        for stack in &stacks {
            let k = stack.v.len();
            for (r, u) in stack.u.iter().enumerate() {
                for (s, v) in stack.v.iter().enumerate() {
                    row.push((stack.positions[r * k + s], 2.0 * u[0] * v[0]));
                }
            }
        }
        return Block::Diagonal(DiagonalBlock::new(constant, vec![row]));
    }
    Block::Dense(DenseBlock { size: n, constant, factored: Factored::new(n, stacks), sparse: Sparse::new(n, entries) })
}

fn scaled_entries(unknown: Unknown, weights: &Mat<f64>, matrix: &Mat<f64>, layout: &Layout, entries: &mut Vec<Entry>) {
    for i in 0..weights.nrows() {
        for j in 0..weights.ncols() {
            let weight = weights[(i, j)];
            if weight == 0.0 {
                continue;
            }
            for column in 0..matrix.ncols() {
                for row in column..matrix.nrows() {
                    let value = 0.5 * weight * (matrix[(row, column)] + matrix[(column, row)]);
                    if value != 0.0 {
                        entries.push(Entry { unknown: layout.position(unknown, i, j), row, column, value });
                    }
                }
            }
        }
    }
}

/// `½(U X Vᵀ + V Xᵀ Uᵀ)`.
#[derive(Clone)]
struct Product {
    unknown: Unknown,
    u: Mat<f64>,
    v: Mat<f64>,
}

impl Product {
    fn of(term: &Term) -> Self {
        let Shape::Product { left, transposed, right } = &term.shape else {
            unreachable!("only products are lowered to products");
        };
        // U Xᵀ V and its transpose Vᵀ X Uᵀ have the same symmetric part.
        let (u, v) = if *transposed {
            (right.transpose().to_owned(), left.clone())
        } else {
            (left.clone(), right.transpose().to_owned())
        };
        Self { unknown: term.unknown, u, v }.normalized()
    }

    /// Moves sign and power of two of V's first entry to U, exactly, so that equal factors compare equal.
    fn normalized(mut self) -> Self {
        let first = (0..self.v.ncols())
            .flat_map(|j| (0..self.v.nrows()).map(move |i| (i, j)))
            .map(|(i, j)| self.v[(i, j)])
            .find(|&v| v != 0.0);
        if let Some(first) = first {
            let scale = 2.0_f64.powi(first.abs().log2().floor().clamp(-900.0, 900.0) as i32).copysign(first);
            self.u *= faer::Scale(scale);
            self.v *= faer::Scale(1.0 / scale);
        }
        self
    }

    /// The same term with the factors exchanged, which a symmetric unknown permits.
    fn flipped(&self) -> Option<Self> {
        self.unknown
            .symmetric
            .then(|| Self { unknown: self.unknown, u: self.v.clone(), v: self.u.clone() }.normalized())
    }
}

/// A product as it is, and flipped where its unknown is symmetric.
type Forms = [Option<Product>; 2];

/// The form with the given right factor, taken out.
fn with_right_factor(forms: &mut Forms, v: &Mat<f64>) -> Option<Product> {
    let fits = forms.iter_mut().find(|form| form.as_ref().is_some_and(|product| same(&product.v, v)));
    fits.and_then(Option::take)
}

/// Products with one right factor.
struct Gathered {
    v: Mat<f64>,
    products: Vec<Product>,
}

/// Gathers products by their right factors, most frequent first.
fn gather(products: Vec<Product>) -> Vec<Gathered> {
    let forms = |product: Product| {
        let flipped = product.flipped();
        [Some(product), flipped]
    };
    let mut left: Vec<Forms> = merge_left_factors(products).into_iter().map(forms).collect();
    let mut gathered = Vec::new();
    while !left.is_empty() {
        let v = most_frequent_right_factor(&left);
        let (mut products, mut rest) = (Vec::new(), Vec::new());
        for mut forms in left {
            match with_right_factor(&mut forms, &v) {
                None => rest.push(forms),
                Some(product) => products.push(product),
            }
        }
        left = rest;
        gathered.push(Gathered { v, products });
    }
    gathered
}

/// One product for each unknown.
fn merge(products: impl Iterator<Item = Product>) -> Vec<Product> {
    let mut merged: Vec<Product> = Vec::new();
    for product in products {
        match merged.iter_mut().find(|m| m.unknown == product.unknown) {
            Some(m) => m.u += &product.u,
            None => merged.push(product),
        }
    }
    merged
}

/// A stack for each right factor.
fn stack(gathered: Vec<Gathered>, layout: &Layout) -> Vec<Stack> {
    let stacks = gathered.into_iter().map(|Gathered { v, products }| {
        let merged = merge(products.into_iter());
        let rows = merged.iter().map(|product| (&product.u, product.unknown));
        stack_of(&v, rows, |unknown, i, j| layout.position(unknown, i, j))
    });
    stacks.filter(|stack| !stack.u.is_empty() && !stack.v.is_empty()).collect()
}

/// The stack of left factors, with what they stand before and where the scalars of that are.
fn stack_of<'a, T: Copy>(
    v: &Mat<f64>,
    rows: impl Iterator<Item = (&'a Mat<f64>, T)>,
    position: impl Fn(T, usize, usize) -> usize,
) -> Stack {
    let columns = nonzero_columns(v);
    let mut stack = Stack { u: Vec::new(), v: columns.iter().map(|&j| column(v, j, 1.0)).collect(), positions: vec![] };
    for (u, of) in rows {
        for i in nonzero_columns(u) {
            stack.u.push(column(u, i, 0.5));
            stack.positions.extend(columns.iter().map(|&j| position(of, i, j)));
        }
    }
    stack
}

/// `U (Σ cₖXₖ) Vᵀ`.
struct Member {
    u: Mat<f64>,
    of: Vec<(Unknown, f64)>,
}

impl Member {
    fn new(product: Product) -> Self {
        let Product { unknown, u, .. } = product;
        let first = first_entry(&u).unwrap_or(1.0);
        // where nothing is lost by it, the factor is taken out of U, which then may be V
        let unit = Mat::from_fn(u.nrows(), u.ncols(), |i, j| u[(i, j)] / first);
        match is_multiple(&u, first, &unit) {
            true => Self { u: unit, of: vec![(unknown, first)] },
            false => Self { u, of: vec![(unknown, 1.0)] },
        }
    }

    /// The factor of an unknown that this holds, if it may hold it too.
    fn factor(&self, product: &Product) -> Option<f64> {
        let shape = |unknown: Unknown| (unknown.rows, unknown.cols, unknown.symmetric);
        let is_other = |(unknown, _): &(Unknown, f64)| *unknown != product.unknown;
        if shape(self.of[0].0) != shape(product.unknown) || !self.of.iter().all(is_other) {
            return None;
        }
        let factor = first_entry(&product.u)? / first_entry(&self.u)?;
        is_multiple(&product.u, factor, &self.u).then_some(factor)
    }

    fn products(self, v: &Mat<f64>) -> impl Iterator<Item = Product> {
        let Self { u, of } = self;
        of.into_iter().map(move |(unknown, factor)| Product { unknown, u: factor * &u, v: v.clone() })
    }
}

/// Products as members, such that differ by a factor alone in one; those that vanish in none.
fn members(products: impl IntoIterator<Item = Product>) -> Vec<Member> {
    let mut members: Vec<Member> = Vec::new();
    for product in products.into_iter().filter(|product| first_entry(&product.u).is_some()) {
        let takes = members.iter_mut().find_map(|member| member.factor(&product).map(|factor| (member, factor)));
        match takes {
            Some((member, factor)) => member.of.push((product.unknown, factor)),
            None => members.push(Member::new(product)),
        }
    }
    members
}

/// Unknowns of a sum that it is worth to look at as one, beside what they are in by themselves.
const MANY: usize = 3;

/// The stacks in combinations of unknowns, where these have three quarters of the scalars at most.
fn combine(gathered: &[Gathered], layout: &Layout) -> Option<(Vec<Stack>, Combinations)> {
    let sum_of = |Gathered { v, products }: &Gathered| {
        let (mut many, few): (Vec<Member>, Vec<Member>) =
            members(products.iter().cloned()).into_iter().partition(|member| member.of.len() >= MANY);
        many.extend(members(merge(few.into_iter().flat_map(|member| member.products(v)))));
        many
    };
    let sums: Vec<Vec<Member>> = gathered.iter().map(sum_of).collect();
    let mut combinations = Combinations { parts: Vec::new(), len: 0 };
    let mut starts: Vec<Vec<usize>> = Vec::new();
    let mut unknowns: Vec<Unknown> = Vec::new();
    for members in &sums {
        let mut of_members = Vec::new();
        for Member { of, .. } in members {
            let of_scalars: Vec<(usize, f64)> =
                of.iter().map(|&(x, factor)| (layout.scalars_of(x).0, factor)).collect();
            let len = layout.scalars_of(of[0].0).1;
            of.iter().for_each(|(x, _)| {
                if !unknowns.contains(x) {
                    unknowns.push(*x)
                }
            });
            let known = combinations.parts.iter().find(|part| part.of == of_scalars).map(|part| part.start);
            of_members.push(known.unwrap_or_else(|| {
                let start = combinations.len;
                combinations.parts.push(Part { start, len, of: of_scalars });
                combinations.len += len;
                start
            }));
        }
        starts.push(of_members);
    }
    let scalars: usize = unknowns.iter().map(|&unknown| layout.scalars_of(unknown).1).sum();
    if 4 * combinations.len >= 3 * scalars {
        return None;
    }
    let stacks = gathered.iter().zip(&sums).zip(&starts).map(|((Gathered { v, .. }, members), starts)| {
        let rows = members.iter().zip(starts).map(|(member, &start)| (&member.u, (member.of[0].0, start)));
        stack_of(v, rows, |(unknown, start), i, j| {
            start + layout.position(unknown, i, j) - layout.scalars_of(unknown).0
        })
    });
    let stacks = stacks.filter(|stack| !stack.u.is_empty() && !stack.v.is_empty()).collect();
    Some((stacks, combinations))
}

fn first_entry(m: &Mat<f64>) -> Option<f64> {
    (0..m.ncols()).flat_map(|j| m.col_as_slice(j)).copied().find(|value| *value != 0.0)
}

/// Whether a = factor · b, to the bit.
fn is_multiple(a: &Mat<f64>, factor: f64, b: &Mat<f64>) -> bool {
    (0..a.ncols()).all(|j| a.col_as_slice(j).iter().zip(b.col_as_slice(j)).all(|(a, b)| *a == factor * b))
}

/// `U X V₁ᵀ + U X V₂ᵀ = U X (V₁ + V₂)ᵀ` where that leaves fewer terms than merging equal right factors would.
fn merge_left_factors(products: Vec<Product>) -> Vec<Product> {
    let distinct = |unknown: Unknown, pick: fn(&Product) -> &Mat<f64>| {
        let mut seen: Vec<&Mat<f64>> = Vec::new();
        for product in products.iter().filter(|p| p.unknown == unknown) {
            if !seen.iter().any(|matrix| same(matrix, pick(product))) {
                seen.push(pick(product));
            }
        }
        seen.len()
    };
    let prefers_left: Vec<bool> = products
        .iter()
        .map(|p| !p.unknown.symmetric && distinct(p.unknown, |p| &p.u) < distinct(p.unknown, |p| &p.v))
        .collect();
    let mut merged: Vec<Product> = Vec::new();
    for (product, prefers_left) in products.into_iter().zip(prefers_left) {
        let fits = |m: &&mut Product| prefers_left && m.unknown == product.unknown && same(&m.u, &product.u);
        match merged.iter_mut().find(fits) {
            Some(m) => m.v += &product.v,
            None => merged.push(product),
        }
    }
    merged
}

fn most_frequent_right_factor(products: &[Forms]) -> Mat<f64> {
    let mut counts: Vec<(&Mat<f64>, usize)> = Vec::new();
    for product in products.iter().flatten().flatten() {
        match counts.iter_mut().find(|(v, _)| same(v, &product.v)) {
            Some((_, count)) => *count += 1,
            None => counts.push((&product.v, 1)),
        }
    }
    // The first among equals, so that the outcome does not depend on anything but the expression.
    let mut best = 0;
    for (i, (_, count)) in counts.iter().enumerate() {
        if *count > counts[best].1 {
            best = i;
        }
    }
    counts[best].0.clone()
}

/// Whether two matrices are equal. Factors of unknowns of different sizes meet in one block, and faer compares matrices of
/// equal size only.
fn same(a: &Mat<f64>, b: &Mat<f64>) -> bool {
    (a.nrows(), a.ncols()) == (b.nrows(), b.ncols()) && a == b
}

fn nonzero_columns(m: &Mat<f64>) -> Vec<usize> {
    (0..m.ncols()).filter(|&j| (0..m.nrows()).any(|i| m[(i, j)] != 0.0)).collect()
}

fn column(m: &Mat<f64>, j: usize, factor: f64) -> Vec<f64> {
    (0..m.nrows()).map(|i| factor * m[(i, j)]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Problem;
    use crate::assembly::Assembly;
    use crate::vectorized::tests::with_every_instruction_set;

    fn patternless(rows: usize, cols: usize) -> Mat<f64> {
        Mat::from_fn(rows, cols, |i, j| ((3 * i + 5 * j + i * j) % 11) as f64 / 7.0 - 0.6)
    }

    /// [−s − sᵀ, Y, Lᵀ; Y, I, 0; L, 0, I] for s = AY − BL.
    fn riccati(y: &Expr, l: &Expr) -> Expr {
        let (n, m) = (y.nrows(), l.nrows());
        let s = patternless(n, n) * y - patternless(n, m) * l;
        Expr::symmetric_blocks(vec![
            vec![-(&s + s.t())],
            vec![y.clone(), Expr::identity(n)],
            vec![l.clone(), Expr::zeros(m, n), Expr::identity(m)],
        ])
    }

    fn stacks(expression: &Expr, layout: &Layout) -> Vec<Stack> {
        stack(gather(expression.terms.iter().map(Product::of).collect()), layout)
    }

    #[test]
    fn a_riccati_inequality_is_one_stack() {
        let mut problem = Problem::new();
        let (y, l) = (problem.symmetric("Y", 3), problem.rectangular("L", 2, 3));
        let layout = Layout::new(&[y.terms[0].unknown, l.terms[0].unknown]);
        let stacks = stacks(&riccati(&y, &l), &layout);
        assert_eq!(stacks.len(), 1);
        assert_eq!((stacks[0].u.len(), stacks[0].v.len()), (5, 3));
    }

    #[test]
    fn only_the_rows_in_use_are_stacked() {
        let mut problem = Problem::new();
        let (y, l) = (problem.symmetric("Y", 3), problem.rectangular("L", 2, 3));
        let layout = Layout::new(&[y.terms[0].unknown, l.terms[0].unknown]);
        let corner = Expr::symmetric_blocks(vec![vec![Expr::identity(1)], vec![l.row(1).t(), y.clone()]]);
        let stacks = stacks(&corner, &layout);
        assert_eq!(stacks.len(), 1);
        assert_eq!(stacks[0].u.len(), 4);
    }

    /// [Ẏ − s − sᵀ, …; …] of two vertices with B in common, for Ẏ = Σ νₖYₖ of all: the sum over the unknowns is looked at as one, and so is L₁ + L₂.
    #[test]
    fn a_block_in_combinations_is_its_expression() {
        with_every_instruction_set(|| {
            let mut problem = Problem::new();
            let y: Vec<Expr> = (0..7).map(|k| problem.symmetric(format!("Y{k}"), 3)).collect();
            let l: Vec<Expr> = (0..7).map(|k| problem.rectangular(format!("L{k}"), 2, 3)).collect();
            let t = problem.scalar("t");
            let unknowns: Vec<Unknown> = y.iter().chain(&l).chain([&t]).map(|x| x.terms[0].unknown).collect();
            let layout = Layout::new(&unknowns);
            for [i, j] in [[0, 3], [5, 1]] {
                let rates = [0.5, -0.5, 0.5, 0.0, 0.3, -0.5, -0.3];
                let rate = rates.iter().zip(&y).fold(Expr::zeros(3, 3), |sum, (&rate, y)| sum + rate * y);
                let of = |i: usize, j: usize| {
                    patternless(3, 3 + i).subcols(i, 3).to_owned() * &y[j] - patternless(3, 2) * &l[j]
                };
                let flow = of(i, j) + of(j, i);
                let f = Expr::symmetric_blocks(vec![
                    vec![2.0 * rate - (&flow + flow.t())],
                    vec![&y[i] + &y[j], Expr::identity(3)],
                    vec![&l[i] + &l[j], Expr::zeros(2, 3), Expr::identity(2)],
                ]);
                let f = f + t.times(&Mat::identity(8, 8));
                let Block::Dense(block) = lower_block(&f, &layout) else { panic!("a dense block") };
                let combinations = block.factored.combinations().expect("many unknowns in one sum");
                // Ẏ, Yᵢ, Yⱼ and Lᵢ + Lⱼ
                assert_eq!(combinations.len, 3 * 6 + 6);
                assert_operators(&f, &layout);
            }
        });
    }

    /// The operators of a lowered block against the expression itself.
    #[test]
    fn a_lowered_block_is_its_expression() {
        with_every_instruction_set(lowered_block);
    }

    fn lowered_block() {
        let mut problem = Problem::new();
        let (y, l, t) = (problem.symmetric("Y", 3), problem.rectangular("L", 2, 3), problem.scalar("t"));
        let unknowns = [y.terms[0].unknown, l.terms[0].unknown, t.terms[0].unknown];
        let layout = Layout::new(&unknowns);
        let f = riccati(&y, &l)
            + t.times(&Mat::identity(8, 8))
            + (y.trace() + 2.0 * &t).times(&Mat::from_fn(8, 8, |i, j| (i * j) as f64));
        assert_operators(&f, &layout);
    }

    /// 8 × 8.
    fn assert_operators(f: &Expr, layout: &Layout) {
        let n = layout.len();
        let block = lower_block(f, layout);
        let mut scratch = block.scratch(n);
        let columns = |m: &Mat<f64>| -> Vec<f64> { (0..64).map(|at| m[(at % 8, at / 8)]).collect() };
        let value = |x: &[f64]| {
            let values = layout.matrices(x);
            columns(&f.evaluate(&|unknown| &values[unknown.index]))
        };
        let zero = value(&vec![0.0; n]);
        assert_eq!(block.constant(), zero);
        let coefficients: Vec<Vec<f64>> = (0..n)
            .map(|k| {
                let mut x = vec![0.0; n];
                x[k] = 1.0;
                let difference: Vec<f64> = value(&x).iter().zip(&zero).map(|(a, b)| a - b).collect();
                let mut out = vec![0.0; 64];
                block.apply(&x, &mut out, &mut scratch);
                assert!(out.iter().zip(&difference).all(|(a, b)| (a - b).abs() < 1e-12));
                difference
            })
            .collect();
        // Symmetric P and Z, M_ij = tr(F_i P F_j Z).
        let symmetric = |m: Mat<f64>| columns(&(&m + m.transpose() + 9.0 * Mat::<f64>::identity(8, 8)));
        let (p, z) = (symmetric(patternless(8, 8)), symmetric(patternless(8, 9).subcols(1, 8).to_owned()));
        let mut adjoint = vec![0.0; n];
        block.adjoint(1.0, &p, &mut adjoint, &mut scratch);
        let mut m = vec![0.0; n * n];
        let blocks = [block];
        let mut assembly = Assembly::new(&blocks);
        blocks[0].schur(0, [&p, &z], &mut assembly, &mut m, n, &mut scratch);
        assembly.add(&mut m, n);
        let matrix = |v: &[f64]| Mat::from_fn(8, 8, |i, j| v[i + 8 * j]);
        for j in 0..n {
            let inner: f64 = coefficients[j].iter().zip(&p).map(|(a, b)| a * b).sum();
            assert!((adjoint[j] - inner).abs() < 1e-10);
            for i in j..n {
                let product = matrix(&coefficients[i]) * matrix(&p) * matrix(&coefficients[j]) * matrix(&z);
                let trace: f64 = (0..8).map(|k| product[(k, k)]).sum();
                assert!(
                    (m[i + j * n] - trace).abs() < 1e-8 * (1.0 + trace.abs()),
                    "({i}, {j}): {} {trace}",
                    m[i + j * n]
                );
            }
        }
    }
}
