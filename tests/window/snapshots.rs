//! The accessibility tree of the window: role and label of every node, in order. A change of words, roles or order shows as a
//! difference; `HOLDSAFE_RENEW=1` writes the files anew.

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
        tell(&seated.root(), &mut drawn);
        let path = folder.join(format!("{name}.txt"));
        if std::env::var_os("HOLDSAFE_RENEW").is_some() {
            std::fs::write(&path, &drawn).expect("a snapshot is written");
        }
        let kept = std::fs::read_to_string(&path).expect("a snapshot; HOLDSAFE_RENEW=1 writes it");
        let differs = kept.lines().zip(drawn.lines()).position(|(kept, drawn)| kept != drawn);
        let at = differs.unwrap_or(kept.lines().count().min(drawn.lines().count()));
        assert!(kept == drawn, "{name}, line {}: {:?}, not {:?}", at + 1, drawn.lines().nth(at), kept.lines().nth(at));
    }
}

fn tell(node: &Node<'_>, into: &mut String) {
    let this = node.accesskit_node();
    let label = this.label().or_else(|| this.value()).unwrap_or_default();
    if !label.is_empty() {
        let off = if this.is_disabled() { " (disabled)" } else { "" };
        into.push_str(&format!("{:?}{off}: {label}\n", this.role()));
    }
    node.children().for_each(|child| tell(&child, into));
}
