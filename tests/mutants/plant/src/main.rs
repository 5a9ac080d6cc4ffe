//! Plants many faults in the sources at once, each behind a switch, so that the tests are built
//! once for all of them and not once for each.
//!
//!   plant TREE < FAULTS            plants them below TREE
//!   plant blame TREE < MESSAGES    names those behind what rustc found wrong
//!
//! FAULTS is what `cargo mutants --list --json` prints, one array after another. A fault's number is
//! its place there, from 1, and it is on while the environment variable `MUTANT` says that number.
//!
//! Responsible for: the tree, and the lists kept in it: `faults.tsv` (number, crate, name),
//! `regions.tsv` (which text belongs to which fault), `left-out.txt` (those that cannot be planted so).
//! Not responsible for: the text itself (`change`), who is to blame (`blame`), the tests (`run`).

mod blame;
mod change;

use std::collections::{BTreeMap, BTreeSet};
use std::io::Read;
use std::path::{Path, PathBuf};

use change::Fault;
use serde_json::Value;

/// What a crate's code asks which fault is on.
const SWITCH: &str = r#"
#[doc(hidden)]
pub fn mutant_is_on(number: u32) -> bool {
    static ON: std::sync::LazyLock<u32> = std::sync::LazyLock::new(|| {
        std::env::var("MUTANT").ok().and_then(|on| on.parse().ok()).unwrap_or(0)
    });
    *ON == number
}
"#;

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let mut input = String::new();
    std::io::stdin()
        .read_to_string(&mut input)
        .expect("an input");
    match args.as_slice() {
        [blame, tree] if blame == "blame" => blame::blame(Path::new(tree), &input),
        [tree] => plant(Path::new(tree), &input),
        _ => panic!("plant TREE, or plant blame TREE"),
    }
}

fn plant(tree: &Path, listed: &str) {
    let (mut names, mut regions) = (String::new(), String::new());
    let mut by_file: BTreeMap<PathBuf, Vec<(usize, Value)>> = BTreeMap::new();
    let lists = serde_json::Deserializer::from_str(listed).into_iter::<Vec<Value>>();
    for (number, fault) in (1..).zip(lists.flat_map(|list| list.expect("a list of faults"))) {
        let text = |key: &str| fault[key].as_str().expect(key);
        names += &format!("{number}\t{}\t{}\n", text("package"), text("name"));
        by_file
            .entry(text("file").into())
            .or_default()
            .push((number, fault));
    }
    let mut left_out = left_out(tree);
    for (file, faults) in by_file {
        let source = std::fs::read_to_string(tree.join(&file)).expect("a source");
        let lines = change::Lines::of(&source);
        let faults: Vec<Fault> = faults
            .iter()
            .filter(|(number, _)| !left_out.contains(number))
            .map(|(number, fault)| Fault::read(*number, fault, &lines))
            .collect();
        let changed = change::change(&source, &lines, &faults);
        for (from, to, number) in changed.regions {
            regions += &format!("{}\t{from}\t{to}\t{number}\n", file.display());
        }
        left_out.extend(changed.left_out);
        std::fs::write(tree.join(&file), changed.text).expect("to write a source");
        add_switch(
            &tree
                .join(file.iter().next().expect("a crate"))
                .join("src/lib.rs"),
        );
    }
    std::fs::write(tree.join("faults.tsv"), names).expect("to write faults.tsv");
    std::fs::write(tree.join("regions.tsv"), regions).expect("to write regions.tsv");
    leave_out(tree, &left_out);
}

fn add_switch(root: &Path) {
    let text = std::fs::read_to_string(root).expect("lib.rs");
    if !text.ends_with(SWITCH) {
        std::fs::write(root, text + SWITCH).expect("to write lib.rs");
    }
}

/// The faults that are not planted.
fn left_out(tree: &Path) -> BTreeSet<usize> {
    let text = std::fs::read_to_string(tree.join("left-out.txt")).unwrap_or_default();
    text.lines().filter_map(|line| line.parse().ok()).collect()
}

fn leave_out(tree: &Path, numbers: &BTreeSet<usize>) {
    let text: String = numbers.iter().map(|number| format!("{number}\n")).collect();
    std::fs::write(tree.join("left-out.txt"), text).expect("to write left-out.txt");
}
