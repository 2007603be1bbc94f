//! Which panes stand where. Panes can be dragged, tabbed and resized; what must always be seen is no pane.

use std::collections::BTreeSet;

use eframe::egui::{Color32, Frame, Id, Margin, Style, Ui, Visuals, WidgetText};
use egui_tiles::{Behavior, Linear, LinearDir, SimplificationOptions, Tile, TileId, Tiles, Tree, UiResponse};
use serde::{Deserialize, Serialize};

use super::desk::Desk;
use super::{Wish, ages, alarms, map, refusals, tracks, why};
use crate::shown::Shown;
use crate::site::Site;

/// Longest saved layout that is read, bytes.
pub const MAX_SAVED: usize = 64 * 1024;

/// A pane.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Pane {
    /// The map from above.
    Map,
    /// The track table.
    Tracks,
    /// The conditions of the chosen unit's mode.
    Why,
    /// Ages over time.
    Ages,
    /// Refusals by reason.
    Refusals,
    /// Alarms.
    Alarms,
}

impl Pane {
    /// Every pane.
    pub const ALL: [Pane; 6] = [Pane::Map, Pane::Tracks, Pane::Why, Pane::Ages, Pane::Refusals, Pane::Alarms];

    /// Its title.
    pub fn title(self) -> &'static str {
        match self {
            Pane::Map => "Map",
            Pane::Tracks => "Tracks",
            Pane::Why => "Why",
            Pane::Ages => "Ages",
            Pane::Refusals => "Refusals",
            Pane::Alarms => "Alarms",
        }
    }
}

/// Layouts to choose from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Preset {
    /// Map and tracks beside each other, the rest below: for whoever commands.
    Operate,
    /// Every pane open: for whoever looks for a cause.
    Examine,
    /// The map, with the rest in tabs: for a wall.
    Map,
}

impl Preset {
    /// Every one.
    pub const ALL: [Preset; 3] = [Preset::Operate, Preset::Examine, Preset::Map];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Preset::Operate => "Operate",
            Preset::Examine => "Examine",
            Preset::Map => "Map",
        }
    }
}

/// A saved layout cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum LayoutError {
    /// Too long.
    #[error("a layout of at most {MAX_SAVED} bytes expected, got {0}")]
    Length(usize),
    /// Not a layout.
    #[error("not a layout: {0}")]
    Schema(#[from] serde_json::Error),
    /// A pane is missing or there twice, or the tree does not hold together.
    #[error("each pane once expected")]
    Panes,
}

/// The layout.
#[derive(Debug)]
pub struct Tiling(Tree<Pane>);

impl Tiling {
    /// One to choose from.
    pub fn new(preset: Preset) -> Self {
        let mut tiles = Tiles::default();
        let [map, tracks, why, ages, refusals, alarms] = Pane::ALL.map(|pane| tiles.insert_pane(pane));
        let root = match preset {
            Preset::Operate => {
                let more = tiles.insert_tab_tile(vec![why, ages, refusals]);
                let upper = beside(&mut tiles, map, tracks, 0.46);
                let lower = beside(&mut tiles, alarms, more, 0.56);
                above(&mut tiles, upper, lower, 0.62)
            }
            Preset::Examine => {
                let left = above(&mut tiles, map, ages, 0.6);
                let middle = above(&mut tiles, why, refusals, 0.58);
                let right = above(&mut tiles, tracks, alarms, 0.55);
                let rest = beside(&mut tiles, middle, right, 0.38);
                beside(&mut tiles, left, rest, 0.34)
            }
            Preset::Map => {
                let more = tiles.insert_tab_tile(vec![tracks, alarms, why, ages, refusals]);
                beside(&mut tiles, map, more, 0.6)
            }
        };
        Self(Tree::new(Id::unique("panes"), root, tiles))
    }

    /// Draws the panes.
    pub(super) fn draw(&mut self, ui: &mut Ui, panes: &mut Panes<'_>) {
        self.0.ui(panes, ui);
    }

    /// Turns to the pane, if it stands behind others.
    pub fn open(&mut self, pane: Pane) {
        self.0.make_active(|_, tile| matches!(tile, Tile::Pane(of) if *of == pane));
    }

    /// As saved.
    pub fn saved(&self) -> Result<String, LayoutError> {
        Ok(serde_json::to_string(&self.0)?)
    }

    /// From what was saved, which may be anything.
    pub fn read(saved: &str) -> Result<Self, LayoutError> {
        if saved.len() > MAX_SAVED {
            return Err(LayoutError::Length(saved.len()));
        }
        let tree: Tree<Pane> = serde_json::from_str(saved)?;
        if holds_together(&tree) { Ok(Self(tree)) } else { Err(LayoutError::Panes) }
    }
}

fn beside(tiles: &mut Tiles<Pane>, left: TileId, right: TileId, share: f32) -> TileId {
    tiles.insert_container(Linear::new_binary(LinearDir::Horizontal, [left, right], share))
}

fn above(tiles: &mut Tiles<Pane>, upper: TileId, lower: TileId, share: f32) -> TileId {
    tiles.insert_container(Linear::new_binary(LinearDir::Vertical, [upper, lower], share))
}

/// Whether every tile but the root is the child of one other that exists, and each pane is there once. With as many
/// tiles as are reached from the root, nothing goes in a circle.
fn holds_together(tree: &Tree<Pane>) -> bool {
    let Some(root) = tree.root() else { return false };
    let (mut seen, mut panes, mut open) = (BTreeSet::new(), BTreeSet::new(), vec![root]);
    while let Some(tile) = open.pop() {
        if !seen.insert(tile.0) {
            return false;
        }
        match tree.tiles.get(tile) {
            Some(Tile::Pane(pane)) if panes.insert(*pane) => {}
            Some(Tile::Container(container)) => open.extend(container.children().copied()),
            Some(Tile::Pane(_)) | None => return false,
        }
    }
    panes.len() == Pane::ALL.len() && seen.len() == tree.tiles.len()
}

/// Draws panes of one picture.
pub(super) struct Panes<'p> {
    pub(super) desk: &'p mut Desk,
    pub(super) site: &'p Site,
    pub(super) shown: &'p Shown,
    pub(super) wishes: &'p mut Vec<Wish>,
}

impl Behavior<Pane> for Panes<'_> {
    fn pane_ui(&mut self, ui: &mut Ui, _: TileId, pane: &mut Pane) -> UiResponse {
        let margin = if *pane == Pane::Map { Margin::ZERO } else { Margin::symmetric(8, 6) };
        Frame::new().fill(ui.visuals().panel_fill).inner_margin(margin).show(ui, |ui| {
            ui.set_min_size(ui.available_size());
            match pane {
                Pane::Map => map::draw(ui, self.desk, self.site, self.shown),
                Pane::Tracks => tracks::draw(ui, self.desk, self.shown, self.wishes),
                Pane::Why => why::draw(ui, self.desk, self.shown),
                Pane::Ages => ages::draw(ui, self.desk, self.shown),
                Pane::Refusals => refusals::draw(ui, self.shown),
                Pane::Alarms => alarms::draw(ui, self.desk, self.shown, self.wishes),
            }
        });
        UiResponse::None
    }

    fn tab_title_for_pane(&mut self, pane: &Pane) -> WidgetText {
        pane.title().into()
    }

    /// Every pane keeps its title, by which it is dragged.
    fn simplification_options(&self) -> SimplificationOptions {
        SimplificationOptions { all_panes_must_have_tabs: true, ..SimplificationOptions::default() }
    }

    fn gap_width(&self, _: &Style) -> f32 {
        4.0
    }

    /// No pane can be made so small that nothing of it is seen.
    fn min_size(&self) -> f32 {
        120.0
    }

    fn tab_bar_color(&self, visuals: &Visuals) -> Color32 {
        visuals.faint_bg_color
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_saved_layout_is_read_again_and_no_other_that_hides_or_repeats_a_pane() {
        for preset in Preset::ALL {
            let tiling = Tiling::new(preset);
            let saved = tiling.saved().unwrap();
            assert_eq!(Tiling::read(&saved).unwrap().0, tiling.0);
            assert!(matches!(Tiling::read(&saved.replace("\"tracks\"", "\"map\"")), Err(LayoutError::Panes)));
        }
        assert!(matches!(Tiling::read("{}"), Err(LayoutError::Schema(_))));
        assert!(matches!(Tiling::read(&" ".repeat(MAX_SAVED + 1)), Err(LayoutError::Length(_))));
    }

    #[test]
    fn a_layout_that_goes_in_a_circle_is_not_drawn() {
        let mut tiling = Tiling::new(Preset::Map);
        let root = tiling.0.root().unwrap();
        let Some(Tile::Container(container)) = tiling.0.tiles.get_mut(root) else { panic!("a root of two") };
        container.add_child(root);
        assert!(matches!(Tiling::read(&tiling.saved().unwrap()), Err(LayoutError::Panes)));
    }
}
