//! Layout of the panes. Panes can be dragged, tabbed and resized; the panels that must always be seen are no panes.

use std::collections::{BTreeMap, BTreeSet};

use eframe::egui::{Color32, Frame, Id, Margin, Style, Ui, Visuals, WidgetText};
use egui_tiles::{Behavior, Linear, LinearDir, SimplificationOptions, Tile, TileId, Tiles, Tree, UiResponse};
use serde::{Deserialize, Serialize};

use super::view_state::ViewState;
use super::{Wish, alarms, map, plots, refusals, tracks, video, why};
use crate::shown::Shown;
use crate::site::Site;

/// Longest file of layouts that is read, bytes.
pub const MAX_SAVED: usize = 64 * 1024;
/// The largest number of a tile.
const MAX_TILE: u64 = 1 << 32;
/// The most layouts that are kept by a name.
pub const MAX_NAMED: usize = 6;
/// The longest name, characters.
pub const MAX_NAME: usize = 16;

/// A pane of the window.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Pane {
    /// The map from above.
    Map,
    /// The conditions of the chosen unit's mode.
    Why,
    /// Values over time.
    Plots,
    /// The track table.
    Tracks,
    /// Images of the tracks.
    Video,
    /// Alarms.
    Alarms,
    /// Events at this display.
    History,
    /// Refusals by reason.
    Refusals,
}

impl Pane {
    /// Every pane.
    pub const ALL: [Pane; 8] =
        [Pane::Map, Pane::Why, Pane::Plots, Pane::Tracks, Pane::Video, Pane::Alarms, Pane::History, Pane::Refusals];

    /// Title of the pane.
    pub fn title(self) -> &'static str {
        match self {
            Pane::Map => "Map",
            Pane::Why => "Why",
            Pane::Plots => "Plots",
            Pane::Tracks => "Tracks",
            Pane::Video => "Video",
            Pane::Alarms => "Alarms",
            Pane::History => "History",
            Pane::Refusals => "Refusals",
        }
    }
}

/// Layouts to choose from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Preset {
    /// Map above alarms, plots above reasons and tracks: for the operator.
    Operate,
    /// Every pane open: for examining a cause.
    Examine,
    /// The map alone, with the rest in tabs behind it: for a wall.
    Map,
}

impl Preset {
    /// Every preset.
    pub const ALL: [Preset; 3] = [Preset::Operate, Preset::Examine, Preset::Map];

    /// Name of the preset.
    pub fn name(self) -> &'static str {
        match self {
            Preset::Operate => "Operate",
            Preset::Examine => "Examine",
            Preset::Map => "Map",
        }
    }
}

/// Saved layouts cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum LayoutError {
    /// The saved text is too long.
    #[error("layouts of at most {MAX_SAVED} bytes expected, got {0}")]
    Length(usize),
    /// Not a layout.
    #[error("no layouts: {0}")]
    Schema(#[from] serde_json::Error),
    /// A pane is missing or there twice, or the tree does not hold together.
    #[error("each pane once expected")]
    Panes,
    /// More of them than are kept, or one by a name that is none.
    #[error("at most {MAX_NAMED} layouts expected, by names of 1 to {MAX_NAME} letters and digits")]
    Names,
}

/// The layout in use, and those that were kept by a name.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Layouts {
    now: Tiling,
    named: BTreeMap<String, Tiling>,
}

impl Default for Layouts {
    fn default() -> Self {
        Self::new(Preset::Operate)
    }
}

impl Layouts {
    /// Layouts with a preset shown and none saved by name.
    pub fn new(preset: Preset) -> Self {
        Self { now: Tiling::new(preset), named: BTreeMap::new() }
    }

    /// The layout in use.
    pub fn now(&mut self) -> &mut Tiling {
        &mut self.now
    }

    /// Turns to one to choose from.
    pub fn start_from(&mut self, preset: Preset) {
        self.now = Tiling::new(preset);
    }

    /// The names, in order.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.named.keys().map(String::as_str)
    }

    /// True if the layout in use can be kept by this name: there is room, or one by it is there to be replaced.
    pub fn takes(&self, name: &str) -> bool {
        is_name(name) && (self.named.len() < MAX_NAMED || self.named.contains_key(name))
    }

    /// Keeps the layout in use by a name that it takes.
    pub fn keep(&mut self, name: &str) {
        if self.takes(name) {
            self.named.insert(name.to_owned(), self.now.clone());
        }
    }

    /// Turns to the layout that was kept by this name.
    pub fn turn_to(&mut self, name: &str) {
        if let Some(tiling) = self.named.get(name) {
            self.now = tiling.clone();
        }
    }

    /// Forgets the layout that was kept by this name.
    pub fn forget(&mut self, name: &str) {
        self.named.remove(name);
    }

    /// Merges named layouts of `other` that neither this one nor the `last` common state has, as far as there is room.
    pub fn join(&mut self, other: &Self, last: &Self) {
        let new = other.named.iter().filter(|(name, _)| !last.named.contains_key(*name));
        for (name, layout) in new {
            if !self.named.contains_key(name) && self.takes(name) {
                self.named.insert(name.clone(), layout.clone());
            }
        }
    }

    /// The layouts as text, to be saved.
    pub fn saved(&self) -> Result<String, LayoutError> {
        Ok(serde_json::to_string(self)?)
    }

    /// Parses saved text, which may be malformed.
    pub fn read(saved: &str) -> Result<Self, LayoutError> {
        if saved.len() > MAX_SAVED {
            return Err(LayoutError::Length(saved.len()));
        }
        // Before layouts had names a file was one of them.
        let layouts = || serde_json::from_str(saved).map(|now| Self { now, named: BTreeMap::new() });
        let mut read: Self = serde_json::from_str(saved).or_else(|error| layouts().map_err(|_| error))?;
        if read.named.len() > MAX_NAMED || !read.names().all(is_name) {
            return Err(LayoutError::Names);
        }
        for Tiling(tree) in [&mut read.now].into_iter().chain(read.named.values_mut()) {
            if !holds_together(tree) {
                return Err(LayoutError::Panes);
            }
            tree.tiles.recompute_next_tile_id();
        }
        Ok(read)
    }
}

fn is_name(name: &str) -> bool {
    let plain = |c: char| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_');
    let is_preset = Preset::ALL.iter().any(|preset| preset.name().eq_ignore_ascii_case(name));
    let sized = (1..=MAX_NAME).contains(&name.chars().count());
    sized && !is_preset && name.chars().all(plain) && name.split(' ').all(|word| !word.is_empty())
}

/// A layout of the panes.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Tiling(Tree<Pane>);

impl Tiling {
    /// The layout of a preset.
    pub fn new(preset: Preset) -> Self {
        let mut tiles = Tiles::default();
        let [map, why, plots, tracks, video, alarms, history, refusals] = Pane::ALL.map(|pane| tiles.insert_pane(pane));
        let root = match preset {
            Preset::Operate => {
                let happened = tiles.insert_tab_tile(vec![alarms, history, refusals]);
                let left = split_vertical(&mut tiles, map, happened, 0.66);
                let reasons = tiles.insert_tab_tile(vec![why, tracks, video]);
                let right = split_vertical(&mut tiles, plots, reasons, 0.6);
                split_horizontal(&mut tiles, left, right, BESIDE_PLOTS)
            }
            Preset::Examine => {
                let left = split_vertical(&mut tiles, map, why, 0.55);
                let middle = split_vertical(&mut tiles, plots, video, 0.6);
                let happened = tiles.insert_tab_tile(vec![alarms, history, refusals]);
                let right = split_vertical(&mut tiles, tracks, happened, 0.5);
                let rest = split_horizontal(&mut tiles, middle, right, 0.5);
                split_horizontal(&mut tiles, left, rest, 0.34)
            }
            Preset::Map => tiles.insert_tab_tile(vec![map, alarms, why, plots, tracks, video, history, refusals]),
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
}

/// Share of the map beside plots and tables.
const BESIDE_PLOTS: f32 = 0.54;

fn split_horizontal(tiles: &mut Tiles<Pane>, left: TileId, right: TileId, share: f32) -> TileId {
    tiles.insert_container(Linear::new_binary(LinearDir::Horizontal, [left, right], share))
}

fn split_vertical(tiles: &mut Tiles<Pane>, upper: TileId, lower: TileId, share: f32) -> TileId {
    tiles.insert_container(Linear::new_binary(LinearDir::Vertical, [upper, lower], share))
}

/// True if every tile but the root is the child of one other existing tile, and each pane is there once and not hidden.
/// With as many tiles as are reached from the root, there is no cycle. A layout with ids that leave no room for another
/// tile is refused.
fn holds_together(tree: &Tree<Pane>) -> bool {
    let Some(root) = tree.root() else { return false };
    let (mut seen, mut panes, mut open) = (BTreeSet::new(), BTreeSet::new(), vec![root]);
    while let Some(tile) = open.pop() {
        if !seen.insert(tile.0) || !tree.is_visible(tile) || tile.0 > MAX_TILE {
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
    pub(super) view_state: &'p mut ViewState,
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
                Pane::Map => map::draw(ui, self.view_state, self.site, self.shown),
                Pane::Tracks => tracks::draw(ui, self.view_state, self.shown, self.wishes),
                Pane::Why => why::draw(ui, self.view_state, self.shown),
                Pane::Plots => plots::draw(ui, self.view_state, self.shown),
                Pane::Video => video::draw(ui, self.view_state, self.shown),
                Pane::Refusals => refusals::draw(ui, self.shown),
                Pane::Alarms => alarms::draw(ui, self.view_state, self.shown, self.wishes),
                Pane::History => alarms::draw_history(ui, self.view_state, self.shown),
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

    fn tab_bar_height(&self, _: &Style) -> f32 {
        30.0
    }

    fn gap_width(&self, _: &Style) -> f32 {
        4.0
    }

    /// No pane can be shrunk out of sight.
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

    /// A layout with a repeated pane is not read either.
    #[test]
    fn saved_layout_is_read_unless_panes_are_missing() {
        for preset in Preset::ALL {
            let mut layouts = Layouts::new(preset);
            layouts.keep("night");
            let saved = layouts.saved().unwrap();
            let read = Layouts::read(&saved).unwrap();
            assert_eq!((&read.now.0, &read.named["night"].0), (&layouts.now.0, &layouts.now.0));
            assert!(matches!(Layouts::read(&saved.replacen("\"tracks\"", "\"map\"", 1)), Err(LayoutError::Panes)));
            for name in ["", " night", "HOLD   F1", "examine", "a\u{202e}b"] {
                assert!(matches!(Layouts::read(&saved.replace("night", name)), Err(LayoutError::Names)), "{name}");
            }
            let before = serde_json::to_string(&layouts.now).unwrap();
            assert_eq!(Layouts::read(&before).unwrap().now.0, layouts.now.0, "of the version before");
            let last = saved.replace("\"next_tile_id\":", "\"next_tile_id\":18446744073709551615,\"was\":");
            assert!(Layouts::read(&last).is_ok(), "numbered anew: {last}");
        }
        assert!(matches!(Layouts::read("{}"), Err(LayoutError::Schema(_))));
        assert!(matches!(Layouts::read(&" ".repeat(MAX_SAVED + 1)), Err(LayoutError::Length(_))));
    }

    #[test]
    fn named_layouts_are_kept_as_room_allows() {
        let mut layouts = Layouts::new(Preset::Map);
        let names = ["a", "b", "c", "d", "e", "f", "g"];
        names.iter().for_each(|name| layouts.keep(name));
        assert_eq!(layouts.names().collect::<Vec<_>>(), names[..MAX_NAMED]);
        let map = layouts.now.clone();
        layouts.start_from(Preset::Examine);
        layouts.keep("b");
        layouts.turn_to("a");
        assert_eq!(layouts.now.0, map.0);
        layouts.turn_to("b");
        assert_eq!(layouts.now.0, Tiling::new(Preset::Examine).0, "it was replaced");
        layouts.forget("a");
        assert!(layouts.takes("g") && !layouts.takes(" g") && !layouts.takes("") && !layouts.takes(&"g".repeat(17)));
        names.iter().for_each(|name| layouts.keep(name));
        let saved = layouts.saved().unwrap();
        assert!(saved.len() < MAX_SAVED / 2, "as many as are kept can be read: {}", saved.len());
    }

    /// A layout forgotten here does not come back.
    #[test]
    fn layouts_of_another_window_are_merged() {
        let mut last = Layouts::default();
        last.keep("old");
        let mut our_layouts = Layouts::read(&last.saved().unwrap()).unwrap();
        let mut their_layouts = Layouts::read(&last.saved().unwrap()).unwrap();
        our_layouts.forget("old");
        their_layouts.start_from(Preset::Map);
        their_layouts.keep("night");
        our_layouts.join(&their_layouts, &last);
        assert_eq!(our_layouts.names().collect::<Vec<_>>(), ["night"]);
        assert_eq!(our_layouts.now.0, Tiling::new(Preset::Operate).0, "the layout in use stays");
    }

    #[test]
    fn cyclic_layout_is_not_drawn() {
        let mut layouts = Layouts::new(Preset::Map);
        let tree = &mut layouts.now.0;
        let root = tree.root().unwrap();
        let Some(Tile::Container(container)) = tree.tiles.get_mut(root) else { panic!("a root of two") };
        container.add_child(root);
        assert!(matches!(Layouts::read(&layouts.saved().unwrap()), Err(LayoutError::Panes)));
    }
}
