//! Which faults are behind what rustc found wrong.
//!
//! Responsible for: leaving them out the next time. Not responsible for: whether they would be wrong
//! by themselves too, which is asked of them one at a time (`run`).

use std::path::Path;

use serde_json::Value;

/// What rustc calls it when a constant is made by a function that is not `const`.
const NOT_CONST: &str = "E0015";

/// Leaves out the faults that the errors of `cargo check --message-format=json` point at; says how many.
pub(crate) fn blame(tree: &Path, messages: &str) {
    let regions = std::fs::read_to_string(tree.join("regions.tsv")).expect("regions.tsv");
    let regions: Vec<Vec<&str>> = regions
        .lines()
        .map(|line| line.split('\t').collect())
        .collect();
    let mut left_out = crate::left_out(tree);
    let before = left_out.len();
    for line in messages.lines() {
        let Ok(line) = serde_json::from_str::<Value>(line) else {
            continue;
        };
        let message = &line["message"];
        if message["level"] != "error" {
            continue;
        }
        let spans = message["spans"].as_array().into_iter().flatten();
        let mut blamed: Vec<usize> = spans.flat_map(|span| at(&regions, span)).collect();
        if message["code"]["code"] == NOT_CONST {
            blamed.extend(within(tree, message["message"].as_str().unwrap_or("")));
        }
        if blamed.is_empty() {
            eprintln!(
                "{}",
                message["rendered"]
                    .as_str()
                    .unwrap_or("an error of no fault")
            );
        }
        left_out.extend(blamed);
    }
    crate::leave_out(tree, &left_out);
    println!("{}", left_out.len() - before);
}

/// The faults in the function that a message of rustc's names: where a constant needs it to be `const`,
/// it cannot ask for its switch.
fn within(tree: &Path, message: &str) -> Vec<usize> {
    let function = message.split('`').nth(1).unwrap_or("");
    let function = function.rsplit("::").next().unwrap_or(function);
    let names = std::fs::read_to_string(tree.join("faults.tsv")).expect("faults.tsv");
    let is_in = |line: &str| {
        // After the place: what is replaced, and in which function.
        let what = line.split_once(": ").map_or("", |(_, what)| what);
        let mut words = what.split(|c: char| !c.is_alphanumeric() && c != '_');
        !function.is_empty() && words.any(|word| word == function)
    };
    let named = names.lines().filter(|line| is_in(line));
    let number = |line: &str| line.split('\t').next()?.parse().ok();
    named.filter_map(number).collect()
}

/// The faults whose text a place of rustc's is in.
fn at(regions: &[Vec<&str>], span: &Value) -> Vec<usize> {
    let byte = |key: &str| span[key].as_u64().expect(key) as usize;
    let (start, end) = (byte("byte_start"), byte("byte_end"));
    let number = |text: &str| text.parse::<usize>().expect("a number");
    regions
        .iter()
        .filter(|region| span["file_name"] == region[0])
        .filter(|region| start < number(region[2]) && number(region[1]) < end)
        .map(|region| number(region[3]))
        .collect()
}
