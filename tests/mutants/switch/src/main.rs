//! Puts mutants that `cargo mutants` lists into sources, each behind its number, so that one build has them all and a run switches one on.
//!
//! Reads from stdin what is to be mutated, writes the sources in place, and says on stdout which mutants stand where. What cannot be asked
//! at run time is left out and said to be: mutants in a `const fn` or a constant, of what returns `impl Trait`, and of a condition that binds (`if let … && …`).

use std::collections::BTreeMap;
use std::io::Read;
use std::path::{Path, PathBuf};

use proc_macro2::{LineColumn, Span};
use serde::{Deserialize, Serialize};
use syn::spanned::Spanned;
use syn::visit::Visit;
use syn::visit_mut::{self, VisitMut};
use syn::{BinOp, Block, Expr, ExprCall, ExprIf, Lit, Signature, parse_quote, parse_str};

/// What is asked for.
#[derive(Deserialize)]
struct Wanted {
    /// The tree that is changed.
    root: PathBuf,
    mutants: Vec<Mutant>,
}

/// A mutant as `cargo mutants --list --json` gives it, with a number.
#[derive(Deserialize)]
struct Mutant {
    number: u32,
    file: PathBuf,
    genre: String,
    replacement: String,
    span: Place,
}

#[derive(Deserialize)]
struct Place {
    start: Point,
}

/// Both from 1.
#[derive(Deserialize)]
struct Point {
    line: usize,
    column: usize,
}

/// Place of a mutant in the changed sources, lines from 1.
#[derive(Serialize)]
struct Stands {
    number: u32,
    file: PathBuf,
    lines: [usize; 2],
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut asked = String::new();
    std::io::stdin().read_to_string(&mut asked)?;
    let Wanted { root, mutants } = serde_json::from_str(&asked)?;
    let mut files: BTreeMap<PathBuf, Vec<Mutant>> = BTreeMap::new();
    for mutant in mutants {
        files.entry(mutant.file.clone()).or_default().push(mutant);
    }
    let mut stand = Vec::new();
    for (file, mutants) in &files {
        stand.extend(change(&root, file, mutants).map_err(|why| format!("{}: {why}", file.display()))?);
    }
    println!("{}", serde_json::to_string(&stand)?);
    Ok(())
}

fn change(root: &Path, name: &Path, mutants: &[Mutant]) -> Result<Vec<Stands>, Box<dyn std::error::Error>> {
    let mut file = syn::parse_file(&std::fs::read_to_string(root.join(name))?)?;
    let ask: Expr =
        if name.starts_with("crates/shared/wire") { parse_quote!(crate::mutant) } else { parse_quote!(wire::mutant) };
    Put { mutants, ask }.visit_file_mut(&mut file);
    let text = prettyplease::unparse(&file);
    std::fs::write(root.join(name), &text)?;
    let mut found = Find { file: name.to_owned(), stand: Vec::new(), last: None };
    found.visit_file(&syn::parse_file(&text)?);
    Ok(found.stand)
}

/// Puts mutants in, the innermost first.
struct Put<'m> {
    mutants: &'m [Mutant],
    ask: Expr,
}

impl Put<'_> {
    /// Mutants of this kind that begin there.
    fn at(&self, genre: &str, span: Span) -> Vec<&Mutant> {
        let LineColumn { line, column } = span.start();
        let here = |m: &&Mutant| m.genre == genre && (m.span.start.line, m.span.start.column) == (line, column + 1);
        self.mutants.iter().filter(here).collect()
    }

    fn asked(&self, mutant: &Mutant) -> Expr {
        let (ask, number) = (&self.ask, mutant.number);
        parse_quote!(#ask(#number))
    }

    /// Mutates a function by a constant value in place of its body.
    fn body(&mut self, signature: &Signature, block: &mut Block) {
        if signature.constness.is_some() {
            return;
        }
        // Two values of which only the trait is known are of two types.
        let opaque =
            matches!(&signature.output, syn::ReturnType::Type(_, of) if matches!(**of, syn::Type::ImplTrait(_)));
        let first = block.stmts.first().map(Spanned::span);
        visit_mut::visit_block_mut(self, block);
        let Some(first) = first.filter(|_| !opaque) else { return };
        for mutant in self.at("FnValue", first) {
            let Ok(value) = parse_str::<Expr>(&mutant.replacement) else { continue };
            let asked = self.asked(mutant);
            block.stmts.insert(0, parse_quote!(if #asked { return #value; }));
        }
    }

    /// `instead` where the mutant is on.
    fn either(&self, mutant: &Mutant, instead: Expr, expr: &mut Expr) {
        let asked = self.asked(mutant);
        let kept = &*expr;
        // What begins with a block would end a statement there.
        *expr = parse_quote!((if #asked { #instead } else { (#kept) }));
    }
}

/// Whether it binds names, as only the condition of an `if` may.
fn binds(expr: &Expr) -> bool {
    match expr {
        Expr::Let(_) => true,
        Expr::Binary(binary) => binds(&binary.left) || binds(&binary.right),
        _ => false,
    }
}

impl VisitMut for Put<'_> {
    fn visit_item_fn_mut(&mut self, item: &mut syn::ItemFn) {
        self.body(&item.sig, &mut item.block);
    }

    fn visit_impl_item_fn_mut(&mut self, item: &mut syn::ImplItemFn) {
        self.body(&item.sig, &mut item.block);
    }

    fn visit_trait_item_fn_mut(&mut self, item: &mut syn::TraitItemFn) {
        if let Some(block) = &mut item.default {
            self.body(&item.sig, block);
        }
    }

    // Nothing is asked where a constant is made.
    fn visit_item_const_mut(&mut self, _: &mut syn::ItemConst) {}
    fn visit_impl_item_const_mut(&mut self, _: &mut syn::ImplItemConst) {}
    fn visit_item_static_mut(&mut self, _: &mut syn::ItemStatic) {}
    fn visit_type_mut(&mut self, _: &mut syn::Type) {}
    fn visit_pat_mut(&mut self, _: &mut syn::Pat) {}

    fn visit_arm_mut(&mut self, arm: &mut syn::Arm) {
        let (whole, guard) = (arm.span(), arm.guard.as_ref().map(|(_, guard)| guard.span()));
        visit_mut::visit_arm_mut(self, arm);
        for mutant in guard.map(|at| self.at("MatchArmGuard", at)).unwrap_or_default() {
            let asked = self.asked(mutant);
            if let Some((_, guard)) = &mut arm.guard
                && !binds(guard)
            {
                let kept = guard.clone();
                **guard = if mutant.replacement == "true" {
                    parse_quote!(#asked || (#kept))
                } else {
                    parse_quote!(!#asked && (#kept))
                };
            }
        }
        for mutant in self.at("MatchArm", whole) {
            let asked = self.asked(mutant);
            match &mut arm.guard {
                Some((_, guard)) if binds(guard) => {}
                Some((_, guard)) => {
                    let kept = guard.clone();
                    **guard = parse_quote!(!#asked && (#kept));
                }
                none => *none = Some((Default::default(), parse_quote!(!#asked))),
            }
        }
    }

    fn visit_expr_mut(&mut self, expr: &mut Expr) {
        let (found, genre) = match &*expr {
            Expr::Binary(of) if !binds(expr) => (self.at("BinaryOperator", of.op.span()), "binary"),
            Expr::Unary(of) => (self.at("UnaryOperator", of.op.span()), "unary"),
            Expr::Struct(of) if of.rest.is_some() => {
                (of.fields.iter().flat_map(|field| self.at("StructField", field.span())).collect(), "struct")
            }
            _ => (Vec::new(), ""),
        };
        let given = |m: &Mutant| match &*expr {
            // Which of its fields.
            Expr::Struct(of) => {
                let stands = |field: &syn::FieldValue| {
                    self.at("StructField", field.span()).iter().any(|at| at.number == m.number)
                };
                of.fields.iter().position(stands)
            }
            _ => None,
        };
        let numbers: Vec<(u32, String, Option<usize>)> =
            found.iter().map(|m| (m.number, m.replacement.clone(), given(m))).collect();
        visit_mut::visit_expr_mut(self, expr);
        let original = expr.clone();
        for (number, replacement, field) in numbers {
            let Some(mutant) = self.mutants.iter().find(|m| m.number == number) else { continue };
            let instead = match (&original, genre) {
                (Expr::Unary(of), "unary") => *of.expr.clone(),
                // A field that is not given comes from the rest.
                (Expr::Struct(of), "struct") => {
                    let fields = of.fields.iter().enumerate().filter(|(at, _)| Some(*at) != field);
                    let fields = fields.map(|(_, field)| field.clone()).collect();
                    Expr::Struct(syn::ExprStruct { fields, ..of.clone() })
                }
                (Expr::Binary(of), "binary") => {
                    let Ok(op) = parse_str::<BinOp>(&replacement) else { continue };
                    let (left, right) = (&of.left, &of.right);
                    parse_quote!((#left) #op (#right))
                }
                _ => continue,
            };
            self.either(mutant, instead, expr);
        }
    }
}

/// Finds mutants in what was written.
struct Find {
    file: PathBuf,
    stand: Vec<Stands>,
    /// Lines of the innermost thing that a mutant without an `if` of its own may be in.
    last: Option<[usize; 2]>,
}

impl<'a> Visit<'a> for Find {
    fn visit_arm(&mut self, arm: &'a syn::Arm) {
        let before = self.last.replace(lines(arm.span()));
        syn::visit::visit_arm(self, arm);
        self.last = before;
    }

    fn visit_expr_if(&mut self, whole: &'a ExprIf) {
        let before = self.last.replace(lines(whole.span()));
        syn::visit::visit_expr(self, &whole.cond);
        self.last = before;
        syn::visit::visit_block(self, &whole.then_branch);
        if let Some((_, other)) = &whole.else_branch {
            syn::visit::visit_expr(self, other);
        }
    }

    fn visit_expr_call(&mut self, call: &'a ExprCall) {
        if let (Expr::Path(path), Some(Expr::Lit(number))) = (&*call.func, call.args.first())
            && path.path.segments.last().is_some_and(|last| last.ident == "mutant")
            && let Lit::Int(number) = &number.lit
            && let (Ok(number), Some(lines)) = (number.base10_parse(), self.last)
        {
            self.stand.push(Stands { number, file: self.file.clone(), lines });
        }
        syn::visit::visit_expr_call(self, call);
    }
}

fn lines(span: Span) -> [usize; 2] {
    [span.start().line, span.end().line]
}
