//! The trust boundary by types: programs that would go around it, and what the compiler says of each.
//!
//! `compile_fail/` holds one program a file, named for what it tries, with the compiler's words beside it. What the types
//! do not hold (that each check judges rightly) is left to the tests of `wire`, `gateway`, `autonomy` and `console`.

#[test]
fn no_way_around_the_boundary_compiles() {
    trybuild::TestCases::new().compile_fail("compile_fail/*.rs");
}
