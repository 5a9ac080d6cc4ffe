//! A source with faults in it, each behind a switch.
//!
//! Responsible for: `if crate::mutant_is_on(7) { what is wrong } else { what is right }`, around the
//! smallest expression that a fault changes or, where it replaces what a function does, before that.
//! Functions that are `const` cannot ask, and are no longer.
//! Not responsible for: whether rustc accepts that.

use proc_macro2::LineColumn;
use serde_json::Value;
use syn::spanned::Spanned;
use syn::visit::{self, Visit};

/// A fault as cargo-mutants lists it.
pub(crate) struct Fault {
    pub(crate) number: usize,
    replacement: String,
    /// Whether it replaces what a function does.
    is_body: bool,
    /// Whether that function says only what its result can do, so that it cannot return two types.
    is_opaque: bool,
    /// Bytes of the source.
    from: usize,
    to: usize,
}

/// A source with faults in it.
pub(crate) struct Changed {
    pub(crate) text: String,
    /// From which byte to which, and of which fault.
    pub(crate) regions: Vec<(usize, usize, usize)>,
    pub(crate) left_out: Vec<usize>,
}

/// Text that goes in at a byte; where several do, the least `order` comes first.
struct Insert {
    at: usize,
    order: i64,
    text: String,
    number: usize,
}

/// Where lines begin, bytes.
pub(crate) struct Lines<'a> {
    text: &'a str,
    starts: Vec<usize>,
}

impl<'a> Lines<'a> {
    pub(crate) fn of(text: &'a str) -> Self {
        let after = text.match_indices('\n').map(|(at, _)| at + 1);
        Self {
            text,
            starts: std::iter::once(0).chain(after).collect(),
        }
    }

    /// Line from 1, column from 0, in characters.
    fn byte(&self, line: usize, column: usize) -> usize {
        let start = self.starts[line - 1];
        let rest = &self.text[start..];
        start
            + rest
                .char_indices()
                .nth(column)
                .map_or(rest.len(), |(at, _)| at)
    }

    fn range(&self, item: &impl Spanned) -> (usize, usize) {
        let at = |place: LineColumn| self.byte(place.line, place.column);
        (at(item.span().start()), at(item.span().end()))
    }
}

impl Fault {
    pub(crate) fn read(number: usize, fault: &Value, lines: &Lines) -> Self {
        let byte = |end: &str| {
            let place = |key: &str| fault["span"][end][key].as_u64().expect(key) as usize;
            lines.byte(place("line"), place("column") - 1)
        };
        let returns = fault["function"]["return_type"].as_str().unwrap_or("");
        Self {
            number,
            replacement: fault["replacement"]
                .as_str()
                .expect("a replacement")
                .to_owned(),
            is_body: fault["genre"] == "FnValue",
            is_opaque: returns.contains("impl "),
            from: byte("start"),
            to: byte("end"),
        }
    }

    fn is_within(&self, (from, to): (usize, usize)) -> bool {
        from <= self.from && self.to <= to
    }
}

/// An expression, as far as it matters here.
#[derive(Clone, Copy)]
struct Around {
    from: usize,
    to: usize,
    /// Whether it is a statement without a semicolon.
    is_statement: bool,
    /// Whether it binds names, which must stay where it is.
    has_let: bool,
}

/// Finds the smallest expression around each fault.
struct Finder<'a> {
    lines: &'a Lines<'a>,
    faults: &'a [Fault],
    found: Vec<Option<Around>>,
    /// Where the word `const` has to go.
    consts: Vec<usize>,
    is_statement: bool,
}

impl Finder<'_> {
    fn enter(&mut self, signature: &syn::Signature, body: &syn::Block) {
        let body = self.lines.range(body);
        if let Some(word) = &signature.constness
            && self.faults.iter().any(|fault| fault.is_within(body))
        {
            self.consts.push(self.lines.range(word).0);
        }
    }
}

impl<'ast> Visit<'ast> for Finder<'_> {
    fn visit_expr(&mut self, expr: &'ast syn::Expr) {
        let is_statement = std::mem::replace(&mut self.is_statement, false);
        let (from, to) = self.lines.range(expr);
        for (fault, found) in self.faults.iter().zip(&mut self.found) {
            if fault.is_within((from, to)) {
                *found = Some(Around {
                    from,
                    to,
                    is_statement,
                    has_let: has_let(expr),
                });
            }
        }
        visit::visit_expr(self, expr);
    }

    fn visit_stmt(&mut self, statement: &'ast syn::Stmt) {
        self.is_statement = matches!(statement, syn::Stmt::Expr(_, None));
        visit::visit_stmt(self, statement);
        self.is_statement = false;
    }

    fn visit_item_fn(&mut self, item: &'ast syn::ItemFn) {
        self.enter(&item.sig, &item.block);
        visit::visit_item_fn(self, item);
    }

    fn visit_impl_item_fn(&mut self, item: &'ast syn::ImplItemFn) {
        self.enter(&item.sig, &item.block);
        visit::visit_impl_item_fn(self, item);
    }
}

fn has_let(expr: &syn::Expr) -> bool {
    match expr {
        syn::Expr::Let(_) => true,
        syn::Expr::Binary(binary) => has_let(&binary.left) || has_let(&binary.right),
        _ => false,
    }
}

/// Plants `faults` in `source`.
pub(crate) fn change(source: &str, lines: &Lines, faults: &[Fault]) -> Changed {
    let mut finder = Finder {
        lines,
        faults,
        found: vec![None; faults.len()],
        consts: Vec::new(),
        is_statement: false,
    };
    finder.visit_file(&syn::parse_file(source).expect("a source"));
    let (mut inserts, mut left_out) = (Vec::new(), Vec::new());
    for (fault, around) in faults.iter().zip(&finder.found) {
        match (around, fault.is_body) {
            (_, true) if !fault.is_opaque => inserts.push(return_early(fault)),
            (Some(around), false) if !around.has_let => {
                inserts.extend(either(source, fault, *around));
            }
            _ => left_out.push(fault.number),
        }
    }
    let mut plain = source.as_bytes().to_vec();
    for at in finder.consts {
        plain[at..at + "const".len()].fill(b' ');
    }
    let plain = String::from_utf8(plain).expect("text");
    inserts.sort_by_key(|insert| (insert.at, insert.order));
    let (text, regions) = render(&plain, &inserts);
    Changed {
        text,
        regions,
        left_out,
    }
}

fn switch(fault: &Fault) -> String {
    format!("if crate::mutant_is_on({})", fault.number)
}

fn return_early(fault: &Fault) -> Insert {
    Insert {
        at: fault.from,
        order: i64::MIN,
        text: format!("{} {{ return {}; }} ", switch(fault), fault.replacement),
        number: fault.number,
    }
}

/// What goes in before and after an expression. Of several that begin at one place the widest comes
/// first; of several that end there, the narrowest.
fn either(source: &str, fault: &Fault, around: Around) -> [Insert; 2] {
    let Around {
        from,
        to,
        is_statement,
        ..
    } = around;
    // A statement in parentheses would want a semicolon.
    let (open, close) = if is_statement { ("", "") } else { ("(", ")") };
    let (before, after) = (&source[from..fault.from], &source[fault.to..to]);
    let (switch, wrong, number) = (switch(fault), &fault.replacement, fault.number);
    let width = (to - from) as i64;
    [
        Insert {
            at: from,
            order: -width,
            text: format!("{open}{switch} {{ {before}{wrong}{after} }} else {{ "),
            number,
        },
        Insert {
            at: to,
            order: width + i64::MIN / 2,
            text: format!(" }}{close}"),
            number,
        },
    ]
}

fn render(source: &str, inserts: &[Insert]) -> (String, Vec<(usize, usize, usize)>) {
    let (mut text, mut regions, mut done) = (String::new(), Vec::new(), 0);
    for insert in inserts {
        text += &source[done..insert.at];
        done = insert.at;
        regions.push((text.len(), text.len() + insert.text.len(), insert.number));
        text += &insert.text;
    }
    text += &source[done..];
    (text, regions)
}
