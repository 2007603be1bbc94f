//! The accessibility tree of the window: role and label of every node, in order. A change of words, roles or order shows as a
//! difference; `HOLDSAFE_RENEW=1` writes the files again.

use std::path::PathBuf;

use egui_kittest::Node;
use egui_kittest::kittest::NodeT;

use crate::scenes::SCENES;
use crate::window::seat;

/// Scenes with a snapshot: one of each kind.
const FEW: [&str; 4] = ["authority", "hold-safe", "armed", "lost"];

#[test]
fn what_is_drawn_is_as_in_its_snapshot() {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("snapshots");
    for (name, scene) in SCENES.iter().filter(|(name, _)| FEW.contains(name)) {
        let seated = seat(scene());
        let mut drawn = String::new();
        write_node(&seated.root(), &mut drawn);
        let path = folder.join(format!("{name}.txt"));
        if std::env::var_os("HOLDSAFE_RENEW").is_some() {
            std::fs::write(&path, &drawn).expect("a snapshot is written");
        }
        let text = std::fs::read_to_string(&path).expect("a snapshot; HOLDSAFE_RENEW=1 writes it");
        let differs = text.lines().zip(drawn.lines()).position(|(text, drawn)| text != drawn);
        let index = differs.unwrap_or(text.lines().count().min(drawn.lines().count()));
        assert!(
            text == drawn,
            "{name}, line {}: {:?}, not {:?}",
            index + 1,
            drawn.lines().nth(index),
            text.lines().nth(index)
        );
    }
}

fn write_node(node: &Node<'_>, into: &mut String) {
    let this = node.accesskit_node();
    let label = this.label().or_else(|| this.value()).unwrap_or_default();
    if !label.is_empty() {
        let off = if this.is_disabled() { " (disabled)" } else { "" };
        into.push_str(&format!("{:?}{off}: {label}\n", this.role()));
    }
    node.children().for_each(|child| write_node(&child, into));
}
