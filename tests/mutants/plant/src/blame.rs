//! Which faults are behind what rustc found wrong.
//!
//! Responsible for: leaving them out the next time. Not responsible for: whether they would be wrong
//! by themselves too, which is asked of them one at a time (`run`).

use std::path::Path;

use serde_json::Value;

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
        let blamed: Vec<usize> = spans.flat_map(|span| at(&regions, span)).collect();
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
