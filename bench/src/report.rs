//! The page of a benchmark: one HTML file that needs nothing else.
//!
//! Responsible for: machine and conditions, findings, figures, a summary of every table.
//! Not responsible for: drawing (`figure`), writing the file (`files`).
//!
//! Tables of the page summarise: one row for all repeats of the same thing, medians with 95 %
//! intervals. The rows themselves are in the CSV files.

use std::fmt::Write;

use crate::figure::Figure;
use crate::results::{Column, Results, Role, Table};
use crate::stats::median_interval;

const STYLE: &str = include_str!("report.css");

/// Most rows of a table on the page; the CSV file has them all.
const MOST_ROWS: usize = 400;

/// The page for these results.
#[must_use]
pub fn page(results: &Results, figures: &[Figure]) -> String {
    let mut page = String::new();
    let title = format!("rearrange bench {}", results.benchmark);
    let _ = write!(
        page,
        "<!doctype html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>{}</title>\n<style>\n{STYLE}</style>\n<h1>{}</h1>\n<p><code>{}</code></p>\n",
        escape(&title),
        escape(&title),
        escape(&results.command)
    );
    if results.partial {
        page.push_str("<p class=\"partial\">Partial: the measurement was interrupted. What follows is what was measured until then.</p>\n");
    }
    conditions(&mut page, results);
    for note in &results.notes {
        let _ = writeln!(page, "<p>{}</p>", escape(note));
    }
    findings(&mut page, results);
    for figure in figures {
        draw(&mut page, results, figure);
    }
    for table in &results.tables {
        summary(&mut page, table);
    }
    page.push_str("</html>\n");
    page
}

fn conditions(page: &mut String, results: &Results) {
    let fixed = [
        ("machine", results.machine.to_string()),
        ("date", results.date.clone()),
        ("version", results.program_version.clone()),
    ];
    let varying = results.conditions.iter();
    page.push_str("<dl>\n");
    for (name, value) in fixed
        .iter()
        .map(|(name, value)| (*name, value))
        .chain(varying.map(|(name, value)| (name.as_str(), value)))
    {
        let _ = writeln!(page, "<dt>{}</dt><dd>{}</dd>", escape(name), escape(value));
    }
    page.push_str("</dl>\n");
}

fn findings(page: &mut String, results: &Results) {
    if results.findings.is_empty() {
        return;
    }
    page.push_str("<h2>Findings</h2>\n<div class=\"wide\"><table>\n");
    for finding in &results.findings {
        let (class, word) = match finding.held {
            Some(true) => ("held", "held"),
            Some(false) => ("failed", "did not hold"),
            None => ("soft", "undecided"),
        };
        let _ = writeln!(
            page,
            "<tr><td class=\"{class}\">{word}</td><td class=\"words\">{}</td><td class=\"words\">{}</td></tr>",
            escape(&finding.claim),
            escape(&finding.evidence)
        );
    }
    page.push_str("</table></div>\n");
}

fn draw(page: &mut String, results: &Results, figure: &Figure) {
    let _ = writeln!(
        page,
        "<figure>\n<h3>{}</h3>\n<div class=\"legend\">",
        escape(&figure.title)
    );
    for (colour, name) in &figure.legend {
        let _ = writeln!(
            page,
            "<span><i style=\"background:{colour}\"></i>{}</span>",
            escape(name)
        );
    }
    let _ = writeln!(
        page,
        "</div>\n{}\n<figcaption>{} <code>{}</code></figcaption>\n</figure>",
        figure.svg,
        escape(&figure.caption),
        escape(&results.command)
    );
}

/// One row for all repeats of the same thing.
fn summary(page: &mut String, table: &Table) {
    let shown: Vec<(usize, &Column)> = table
        .columns
        .iter()
        .enumerate()
        .filter(|(_, column)| column.role != Role::Repeat)
        .collect();
    let groups = table.groups();
    let _ = writeln!(
        page,
        "<h2>{}</h2>\n<p class=\"soft\">Medians with 95 % intervals over the repeats; every row is in {}.csv.</p>\n<div class=\"wide\"><table>\n<tr>",
        escape(&table.title),
        escape(&table.name)
    );
    for (_, column) in &shown {
        let class = if column.role == Role::Key {
            ""
        } else {
            " class=\"number\""
        };
        let _ = write!(
            page,
            "<th{class} title=\"{}\">{}<span class=\"unit\">{}</span></th>",
            escape(&column.about),
            escape(&column.name),
            escape(&column.unit)
        );
    }
    page.push_str("</tr>\n");
    for (_, rows) in groups.iter().take(MOST_ROWS) {
        page.push_str("<tr>");
        for (index, column) in &shown {
            let (class, text) = cell(table, *index, column, rows);
            let _ = write!(page, "<td class=\"{class}\">{}</td>", escape(&text));
        }
        page.push_str("</tr>\n");
    }
    page.push_str("</table></div>\n");
    if groups.len() > MOST_ROWS {
        let _ = writeln!(page, "<p>and {} more.</p>", groups.len() - MOST_ROWS);
    }
}

fn cell(table: &Table, index: usize, column: &Column, rows: &[usize]) -> (&'static str, String) {
    let cells = || rows.iter().map(|row| &table.rows[*row][index]);
    if column.role == Role::Key {
        return (
            "",
            cells().next().map_or_else(String::new, ToString::to_string),
        );
    }
    let numbers: Vec<_> = cells().filter_map(|cell| cell.number()).collect();
    match median_interval(&numbers) {
        Some(estimate) if estimate.high - estimate.low > estimate.value.abs() * 1e-9 => (
            "number",
            format!(
                "{} [{}, {}]",
                short(estimate.value),
                short(estimate.low),
                short(estimate.high)
            ),
        ),
        Some(estimate) => ("number", short(estimate.value)),
        None => {
            let mut words: Vec<_> = cells()
                .map(ToString::to_string)
                .filter(|word| !word.is_empty())
                .collect();
            words.dedup();
            words.truncate(3);
            ("words", words.join("; "))
        }
    }
}

/// A number with four significant digits, whole numbers whole.
#[must_use]
pub fn short(number: f64) -> String {
    if number == number.trunc() && number.abs() < 1e15 {
        return format!("{number}");
    }
    let digits = (3.0 - number.abs().log10().floor()).clamp(0.0, 12.0) as usize;
    format!("{number:.digits$}")
}

/// Text as HTML has it.
fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::results::Finding;

    #[test]
    fn a_page_tells_all_and_nothing_in_it_is_taken_for_markup() {
        let mut results = Results::new("paper", "rearrange bench paper --out <here>");
        let mut table = Table::new("runs", "Runs")
            .key("room", "", "")
            .repeat()
            .lower("time_s", "s", "");
        for (repeat, time) in [(0, 1.0), (1, 3.0), (2, 2.0)] {
            table.push(vec!["a&b".into(), (repeat as u64).into(), time.into()]);
        }
        results.tables.push(table);
        results.findings.push(Finding {
            claim: "it is fast".into(),
            held: Some(false),
            evidence: "2 s".into(),
        });
        let page = page(&results, &[]);
        assert!(page.contains("--out &lt;here&gt;") && page.contains("a&amp;b"));
        assert!(page.contains("did not hold") && !page.contains("Partial"));
        assert!(page.contains(">2 [1, 3]<"), "{page}");
        results.partial = true;
        assert!(super::page(&results, &[]).contains("Partial"));
    }

    #[test]
    fn numbers_are_short() {
        assert_eq!(
            [1.0, 0.012_345, 1234.56, -2.5].map(short),
            ["1", "0.01235", "1235", "-2.500"]
        );
    }
}
