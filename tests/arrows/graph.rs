//! Circles among the rooms of each folder.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Component, Path};

/// Arrows from file to file.
pub(crate) type Arrows = BTreeSet<(String, String)>;

/// Every circle as `folder: room, room, …`.
pub(crate) fn circles(arrows: &Arrows) -> Vec<String> {
    let mut folders: BTreeMap<String, BTreeMap<String, BTreeSet<String>>> = BTreeMap::new();
    for (from, to) in arrows {
        let (folder, [from, to]) = rooms(from, to);
        let rooms = folders.entry(folder).or_default();
        rooms.entry(from).or_default().insert(to);
    }
    let of_folder = |(folder, rooms): (&String, &BTreeMap<_, _>)| {
        let circles = in_folder(rooms);
        let named = circles
            .iter()
            .map(|rooms| format!("{folder}: {}", rooms.join(", ")));
        named.collect::<Vec<_>>()
    };
    folders.iter().flat_map(of_folder).collect()
}

/// The folder in which the two files are in different rooms, and the rooms.
fn rooms(from: &str, to: &str) -> (String, [String; 2]) {
    let parts = |path: &str| -> Vec<String> {
        let part = |part: Component| part.as_os_str().to_string_lossy().into_owned();
        Path::new(path).components().map(part).collect()
    };
    let (from, to) = (parts(from), parts(to));
    let same = from.iter().zip(&to).take_while(|(a, b)| a == b).count();
    (
        from[..same].join("/"),
        [from[same].clone(), to[same].clone()],
    )
}

/// Rooms that reach each other.
fn in_folder(rooms: &BTreeMap<String, BTreeSet<String>>) -> Vec<Vec<String>> {
    let mut reach: BTreeMap<&String, BTreeSet<&String>> = BTreeMap::new();
    for start in rooms.keys() {
        let mut found = BTreeSet::new();
        let mut open = vec![start];
        while let Some(room) = open.pop() {
            let next = rooms.get(room).into_iter().flatten();
            open.extend(next.filter(|room| found.insert(*room)));
        }
        reach.insert(start, found);
    }
    let mutual = |a: &String, b: &String| {
        let reaches = |a, b| reach.get(a).is_some_and(|found| found.contains(b));
        reaches(a, b) && reaches(b, a)
    };
    let mut circles: Vec<Vec<String>> = Vec::new();
    for room in rooms.keys() {
        match circles.iter_mut().find(|circle| mutual(&circle[0], room)) {
            Some(circle) => circle.push(room.clone()),
            None if mutual(room, room) => circles.push(vec![room.clone()]),
            None => {}
        }
    }
    circles
}
