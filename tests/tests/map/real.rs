//! Real frames of real objects, where they are there: `shared/real` beside the repository.

use nudge_core::camera::UNLABELLED;
use nudge_core::episode::EpisodeDir;
use nudge_core::recording::{Board, Recording, Settings};
use nudge_core::scene::{BACKGROUND, Catalog};
use nudge_core::{Point, grid::Cell};
use nudge_tests::{Folder, argument, nudge_ok, root};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A cell that fewer pixels of a label show is of its edge.
const PIXELS: usize = 3;

fn recordings() -> Option<PathBuf> {
    let found = root().ancestors().map(|folder| folder.join("shared/real")).find(|folder| folder.is_dir());
    if found.is_none() {
        eprintln!("not checked: there is no shared/real with real frames");
    }
    found
}

/// The floor cells that each label's pixels show, with the number of pixels.
fn visible(recording: &Path) -> BTreeMap<u8, BTreeMap<usize, usize>> {
    let board = Board::default();
    let settings = Settings { edge_deg: 0.0, ..Settings::default() };
    let frame = Recording::open(recording, settings).and_then(|recording| recording.frame(0, &board)).expect("a frame");
    let (grid, pose, width) = (board.shelf.grid(), *frame.world_from_camera(), frame.size()[0]);
    let mut cells = BTreeMap::<u8, BTreeMap<usize, usize>>::new();
    for (at, (depth, label)) in frame.depth_m().iter().zip(frame.labels().iter()).enumerate() {
        let ray = frame.intrinsics().ray(at % width, at / width);
        let point = pose * Point::from(ray * *depth);
        let cell: Option<Cell> = grid.cell_at(point).filter(|_| *depth > 0.0 && (-0.01..0.4).contains(&point.z));
        if let (Some(cell), true) = (cell, *label != UNLABELLED) {
            *cells.entry(*label).or_default().entry(grid.cell_index(cell)).or_default() += 1;
        }
    }
    cells
}

#[test]
fn every_object_of_a_real_frame_is_found_and_the_table_is_not() {
    let Some(folder) = recordings() else { return };
    let (out, catalog) = (Folder::new(), Catalog::standard());
    for (table, objects) in [("table1", 3), ("table3", 2), ("table5", 2)] {
        let (recording, episode) = (folder.join(table), out.path(table));
        nudge_ok(&["map", &argument(&recording), "--out", &argument(&episode)]);
        let belief = EpisodeDir::open(&episode).and_then(|directory| directory.read_belief(1)).expect("a belief");
        let is_occupied =
            |cell: &usize| belief.occupancy[belief.grid.column(*cell)].iter().any(|[occupied, free]| occupied > free);
        let class = |cell: usize| {
            let alpha = &belief.semantics[cell];
            (0..alpha.len()).max_by(|a, b| alpha[*a].total_cmp(&alpha[*b])).unwrap_or(0) as u8
        };
        let visible = visible(&recording);
        let whole = |label: &u8| -> Vec<usize> {
            visible[label].iter().filter(|(_, pixels)| **pixels >= PIXELS).map(|(cell, _)| *cell).collect()
        };
        let labels: Vec<u8> = visible.keys().copied().filter(|label| *label != BACKGROUND.0).collect();
        assert_eq!(labels.len(), objects, "{table}");
        for label in labels {
            let cells = whole(&label);
            let found = cells.iter().filter(|cell| is_occupied(cell) && class(**cell) == label).count();
            let share = found as f64 / cells.len() as f64;
            let name = catalog.name(nudge_core::scene::ClassId(label));
            eprintln!("{table}: {name}: {:.0} % of {} cells", 100.0 * share, cells.len());
            assert!(share >= 0.6, "{table}: {name}: {share}");
        }
        let board = whole(&BACKGROUND.0);
        let taken = board.iter().filter(|cell| is_occupied(cell)).count() as f64 / board.len() as f64;
        eprintln!("{table}: {:.1} % of the table is believed occupied", 100.0 * taken);
        assert!(taken < 0.03, "{table}: {taken}");
    }
}

#[test]
fn the_board_of_a_real_table_is_found_where_a_plane_was_fitted() {
    let Some(folder) = recordings() else { return };
    for table in ["table1", "table3", "table5"] {
        let said = nudge_ok(&["map", &argument(&folder.join(table)), "--find-board", "--frames-only"]);
        let line = said.lines().find(|line| line.starts_with("board found: ")).expect("a board");
        let between = |from: &str, to: &str| -> Vec<f32> {
            let rest = &line[line.find(from).expect("there") + from.len()..];
            rest[..rest.find(to).expect("there")].split(", ").map(|n| n.parse().expect("a number")).collect()
        };
        let (at, turned) = (between("front edge at [", "]"), between("turned by ", " degrees"));
        assert!(at[2].abs() < 0.005 && turned[0].abs() < 1.0 && turned[1].abs() < 1.0, "{table}: {line}");
    }
}
