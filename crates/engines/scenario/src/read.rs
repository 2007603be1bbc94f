//! Conversion of a path to a checked [`Scenario`] or [`Platform`], or to problems with their place.
//!
//! The size of a file is looked at before its content; a file that a scenario names lies below the scenario's directory, or
//! that of the shipped scenarios for one of them, and no step to it is a symbolic link.

use std::fs;
use std::path::{Component, Path, PathBuf};

use serde::de::DeserializeOwned;

use super::check;
use super::extend::Sources;
use super::file::read_text;
use super::finding::Finding;
use super::platform;
use super::shipped::shipped_folder;
use super::{Located, Platform, Problem, Problems, RelativePath, Scenario, Scene};

/// Reads and checks the scenario at `path`. One from outside the shipped folders extends the files beside it alone.
///
/// # Errors
/// Every problem found; grouped by file, problems of the scene's file apart.
pub fn load(path: &Path) -> Result<Scenario, Problems> {
    load_with(path, None)
}

/// Loads a scenario from anywhere, which may extend those that are shipped below `root`.
///
/// # Errors
/// As [`load`].
pub fn load_with(path: &Path, root: Option<&Path>) -> Result<Scenario, Problems> {
    let sources = Sources::load(path, root)?;
    let stem = path.file_stem().and_then(|s| s.to_str()).unwrap_or_default();
    let mut scenario = read_scenario(&sources)?;
    if let Some(located) = &scenario.scene_file {
        scenario.scene = Some(load_scene(&sources, located)?);
    }
    // Its content is the same as that of a file with everything written out.
    scenario.extends = None;
    settle(&sources, stem, &scenario)?;
    Ok(scenario)
}

/// Checks a scenario's text by itself; one that names a scene file or another scenario is refused, for there is no directory
/// to look in.
///
/// # Errors
/// Every problem found, with `file` as its name.
pub fn parse(file: &str, stem: &str, text: &str) -> Result<Scenario, Problems> {
    let sources = Sources::one(file, text);
    let scenario = read_scenario(&sources)?;
    let refuse = |bytes, message, remedy| Problems::from(sources.problem(bytes, message, remedy));
    if let Some(located) = &scenario.extends {
        let remedy = "write out what it takes from the other";
        return Err(refuse(located.bytes(), "a scenario that extends another needs to be a file", remedy));
    }
    if let Some(located) = &scenario.scene_file {
        let message = "a scene file needs the scenario to be a file";
        return Err(refuse(located.bytes(), message, "write the scene as `[scene]`"));
    }
    settle(&sources, stem, &scenario)?;
    Ok(scenario)
}

/// Reads and checks a platform file.
///
/// # Errors
/// Every problem found.
pub fn load_platform(path: &Path) -> Result<Platform, Problems> {
    let file = path.display().to_string();
    let text = read_text(path, &file)?;
    parse_platform(&file, path.file_stem().and_then(|s| s.to_str()).unwrap_or_default(), &text)
}

/// Checks a platform's text by itself.
///
/// # Errors
/// Every problem found, with `file` as its name.
pub fn parse_platform(file: &str, stem: &str, text: &str) -> Result<Platform, Problems> {
    let platform: Platform = toml::from_str(text).map_err(|e| Problem::of_platform(file, text, &e))?;
    Problems::none_or(place(file, text, platform::check::platform(&platform, stem)))?;
    Ok(platform)
}

/// Checks a scene's text by itself.
///
/// # Errors
/// Every problem found, with `file` as its name.
pub fn parse_scene(file: &str, text: &str) -> Result<Scene, Problems> {
    let scene: Scene = from_toml(file, text)?;
    Problems::none_or(place(file, text, check::scene(&scene)))?;
    Ok(scene)
}

fn read_scenario(sources: &Sources) -> Result<Scenario, Problems> {
    let scenario = sources.read()?;
    let (message, bytes) = match (&scenario.scene, &scenario.scene_file) {
        (Some(_), Some(at)) => ("both `[scene]` and `scene_file`", at.bytes()),
        (None, None) if scenario.is_of_stacks() => return Ok(scenario),
        (None, None) => ("neither `[scene]` nor `scene_file`", scenario.name.bytes()),
        (Some(_), None) | (None, Some(_)) => return Ok(scenario),
    };
    Err(sources.problem(bytes, message, "give the scene once, in the file or by its own file").into())
}

fn from_toml<T: DeserializeOwned>(file: &str, text: &str) -> Result<T, Problems> {
    toml::from_str(text).map_err(|e| Problem::from_toml(file, text, &e).into())
}

fn load_scene(sources: &Sources, located: &Located<RelativePath>) -> Result<Scene, Problems> {
    let refuse = |message: &str, remedy: &str| sources.problem(located.bytes(), message, remedy);
    let mut path = scene_folder(sources.path_at(&located.bytes()), located);
    for part in Path::new(located.as_str()).components() {
        let Component::Normal(part) = part else {
            return Err(refuse("path leaves the scenario directory", "write it relative, without `..`").into());
        };
        path.push(part);
        match fs::symlink_metadata(&path) {
            Ok(meta) if meta.file_type().is_symlink() => {
                return Err(refuse("path leads through a symbolic link", "copy the file below the scenario").into());
            }
            Ok(_) => {}
            Err(_) => {
                let remedy = format!("create {} or correct the path", path.display());
                return Err(refuse("no such file", &remedy).into());
            }
        }
    }
    let scene_file = path.display().to_string();
    parse_scene(&scene_file, &read_text(&path, &scene_file)?)
}

/// The folder below which a scene's file lies: that of the file which names it or, for a shipped one, that of all scenarios.
fn scene_folder(named_in: &Path, scene: &RelativePath) -> PathBuf {
    let path = named_in.parent().unwrap_or(Path::new("")).to_path_buf();
    let shipped = || shipped_folder(named_in).filter(|folder| folder.join(scene.as_str()).exists());
    if path.join(scene.as_str()).exists() { path } else { shipped().unwrap_or(path) }
}

fn settle(sources: &Sources, stem: &str, scenario: &Scenario) -> Result<(), Problems> {
    let mut findings = check::scenario(scenario, stem);
    if let (Some(scene), None) = (&scenario.scene, &scenario.scene_file) {
        findings.extend(check::scene(scene));
    }
    let problem = |f: Finding| sources.problem(f.bytes, f.message, f.remedy);
    Problems::none_or(findings.into_iter().map(problem).collect())
}

fn place(file: &str, text: &str, findings: Vec<Finding>) -> Vec<Problem> {
    findings.into_iter().map(|f| Problem::new(file, text, f.bytes, f.message, f.remedy)).collect()
}
