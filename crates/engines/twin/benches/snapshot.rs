//! Memory of a snapshot of a running twin, core by core: bytes that a fork takes from the allocator and keeps, and the
//! core's own. Parts shared with the original (scene, terrain, model) are not in it.
//!
//! Run with `cargo bench --bench snapshot` (or with `--profile dev`: bytes are the same).

#![expect(unsafe_code, reason = "counting bytes takes a global allocator, here and nowhere else")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

use scenario::{Setup, find_root};
use twin::trial::start;
use wire::id::WorldId;

/// At a given number of moments, evenly over the run, as a search keeps them.
const MOMENTS: u64 = 64;

/// The system's allocator, with the bytes that are out.
struct Counting;

static OUT: AtomicUsize = AtomicUsize::new(0);

#[global_allocator]
static ALLOCATOR: Counting = Counting;

// SAFETY: everything is the system allocator's; counting touches nothing of it.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        OUT.fetch_add(layout.size(), Ordering::Relaxed);
        // SAFETY: the caller's promise about the layout is passed on.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        OUT.fetch_sub(layout.size(), Ordering::Relaxed);
        // SAFETY: the caller's promise about block and layout is passed on.
        unsafe { System.dealloc(pointer, layout) }
    }
}

fn main() {
    for rendered in [false, true] {
        measure(rendered);
    }
}

fn measure(rendered: bool) {
    let root = find_root(Path::new(env!("CARGO_MANIFEST_DIR"))).expect("the scenarios are above");
    let nominal = scenario::load(&root.join("scenarios/control/nominal.toml")).expect("nominal is sound");
    let setup = Setup::load(&root, &nominal, None, rendered).expect("its setup is");
    let (topology, mut twin) = start(&nominal, &setup, 1, false).expect("its topology can be made");
    let mut most = vec![0; twin.nodes().len()];
    let (mut cores, mut whole) = (0, 0);
    for n in 1..=MOMENTS {
        twin.run_until(topology.duration * n / MOMENTS);
        let parts: Vec<usize> = twin.nodes().iter().map(|node| bytes_held(|| node.part.fork(WorldId(1)))).collect();
        cores = cores.max(parts.iter().sum());
        whole = whole.max(bytes_held(|| twin.fork(WorldId(1))));
        most.iter_mut().zip(parts).for_each(|(most, now)| *most = now.max(*most));
    }
    println!("nominal, {}, most of {MOMENTS} moments", if rendered { "rendered" } else { "unrendered" });
    for (node, bytes) in twin.nodes().iter().zip(most) {
        println!("  {:24} {:8.1} KiB", node.id.name(), kib(bytes));
    }
    println!("  {:24} {:8.1} KiB", "all cores at a moment", kib(cores));
    println!("  {:24} {:8.1} KiB", "the twin, with its log", kib(whole));
}

/// Bytes of the value that `make` gives, as long as it is kept.
fn bytes_held<T>(make: impl FnOnce() -> T) -> usize {
    let before = OUT.load(Ordering::Relaxed);
    let made = make();
    let bytes = OUT.load(Ordering::Relaxed).saturating_sub(before);
    drop(made);
    bytes + size_of::<T>()
}

fn kib(bytes: usize) -> f64 {
    bytes as f64 / 1024.0
}
