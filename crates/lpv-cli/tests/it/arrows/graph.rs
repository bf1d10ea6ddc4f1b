//! Circles of a directed graph.

use std::collections::{BTreeMap, BTreeSet};

/// Arrows between named nodes.
pub type Arrows = BTreeSet<(String, String)>;

/// The sets of nodes that reach each other, each set with more than one.
pub fn circles(arrows: &Arrows) -> Vec<BTreeSet<String>> {
    let mut next: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for (from, to) in arrows {
        next.entry(from).or_default().push(to);
    }
    let reached = |start| {
        let mut seen: BTreeSet<&str> = BTreeSet::new();
        let mut open: Vec<&str> = vec![start];
        while let Some(node) = open.pop() {
            open.extend(next.get(node).into_iter().flatten().filter(|node| seen.insert(node)));
        }
        seen
    };
    let reach: BTreeMap<&str, _> = next.keys().map(|&node| (node, reached(node))).collect();
    let mut found: BTreeSet<BTreeSet<String>> = BTreeSet::new();
    for (node, seen) in &reach {
        let back = seen.iter().filter(|other| reach.get(**other).is_some_and(|seen| seen.contains(node)));
        let circle: BTreeSet<String> = back.map(|node| node.to_string()).collect();
        if circle.len() > 1 {
            found.insert(circle);
        }
    }
    found.into_iter().collect()
}

/// The arrows inside of a circle.
pub fn within<'a>(arrows: &'a Arrows, circle: &BTreeSet<String>) -> Vec<&'a (String, String)> {
    arrows.iter().filter(|(from, to)| circle.contains(from) && circle.contains(to)).collect()
}
