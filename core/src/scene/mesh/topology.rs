//! From loose triangles to closed surfaces: corners joined, holes found, winding repaired, components separated.

use super::bounds_of;
use crate::Point;
use std::collections::{BTreeMap, HashMap, HashSet};

/// Corners closer than these shares of the mesh's size are one; the first that closes the mesh is taken.
const WELD: [f32; 3] = [1e-7, 1e-5, 1e-4];

/// Corners closer than this share of the mesh's size make two surfaces the same one.
const SAME: f32 = 1e-5;

/// Triangles that belong together; once it is found, one closed surface, wound outwards.
#[derive(Default)]
pub struct Component {
    /// Corners, metres.
    pub points: Vec<Point>,
    /// Triangles, counter-clockwise from outside.
    pub triangles: Vec<[u32; 3]>,
}

impl Component {
    /// Volume inside, cubic metres; negative when wound inwards.
    pub fn volume(&self) -> f64 {
        // About the first corner: a mesh far from its origin would lose all digits.
        let origin = self.points.first().copied().unwrap_or_else(Point::origin);
        let corner = |i: u32| (self.points[i as usize] - origin).cast::<f64>();
        self.triangles.iter().map(|[a, b, c]| corner(*a).dot(&corner(*b).cross(&corner(*c))) / 6.0).sum()
    }
}

/// The closed surfaces of a mesh.
pub struct Topology {
    /// The surfaces, in the order of their first triangle.
    pub components: Vec<Component>,
    /// Triangles that were wound against their neighbours.
    pub turned: usize,
    /// Surfaces wound inwards inside others, left out.
    pub cavities: usize,
    /// Triangles that lie where others lie already, left out.
    pub repeated: usize,
}

/// Why there is no closed surface.
pub enum Fault {
    /// Every triangle has shrunk to a line.
    Flat,
    /// There are holes.
    Open {
        /// Edges with a triangle on one side only.
        edges: usize,
        /// The middle of the first.
        first: Point,
    },
}

/// Finds the closed surfaces. Every group on its own when all are closed, so that parts that touch stay apart; all
/// groups together otherwise (a surface may be split into groups by material).
pub fn components(groups: &[Component]) -> Result<Topology, Fault> {
    let all = bounds_of(
        groups.iter().flat_map(|group| group.triangles.iter().flatten().map(move |i| group.points[*i as usize])),
    );
    let extent = all.map_or(0.0, |bounds| bounds.size().max());
    let apart: Option<Vec<Closed>> = groups.iter().map(|group| closed_by_welding(group, extent).ok()).collect();
    let found = match apart {
        Some(found) => found,
        None => vec![closed_by_welding(&merged(groups), extent)?],
    };
    let mut repeated: usize = found.iter().map(|found| found.repeated).sum();
    let mut surfaces: Vec<Component> = found.into_iter().flat_map(|found| found.surfaces).collect();
    repeated += leave_out_copies(&mut surfaces, extent * SAME);
    let mut topology = Topology { components: Vec::new(), turned: 0, cavities: 0, repeated };
    for surface in &mut surfaces {
        topology.turned += make_winding_consistent(surface);
    }
    // The largest surface is an outside, whichever way it is wound.
    let largest = surfaces.iter().map(Component::volume).max_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap_or(0.0);
    let outer: Vec<_> = surfaces.iter().filter(|s| s.volume() * largest > 0.0).map(bounds).collect();
    for mut surface in surfaces {
        if surface.volume() * largest < 0.0 {
            let inside = |outer: &crate::solid::Bounds| {
                let own = bounds(&surface);
                (0..3).all(|axis| outer.min[axis] <= own.min[axis] && own.max[axis] <= outer.max[axis])
            };
            if outer.iter().any(inside) {
                topology.cavities += 1;
                continue;
            }
        }
        if surface.volume() < 0.0 {
            surface.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        }
        topology.components.push(surface);
    }
    Ok(topology)
}

fn bounds(surface: &Component) -> crate::solid::Bounds {
    bounds_of(surface.points.iter().copied())
        .unwrap_or(crate::solid::Bounds { min: Point::origin(), max: Point::origin() })
}

/// Closed surfaces, and how many triangles were there more than once.
struct Closed {
    surfaces: Vec<Component>,
    repeated: usize,
}

/// Joins corners until the group is closed. A triangle that is there twice counts once, where what is left is closed
/// (two boxes side by side share their wall, and need it twice) or where all are.
fn closed_by_welding(group: &Component, extent: f32) -> Result<Closed, Fault> {
    let mut first_fault = None;
    for share in WELD {
        let welded = weld(group, share * extent);
        let once = once_each(&welded);
        let repeated = welded.triangles.len() - once.triangles.len();
        let found = match closed(&once) {
            Ok(surfaces) => Ok(Closed { surfaces, repeated }),
            Err(fault) if repeated == 0 || repeated >= once.triangles.len() => Err(fault),
            Err(_) => closed(&welded).map(|surfaces| Closed { surfaces, repeated: 0 }),
        };
        match found {
            Ok(found) => return Ok(found),
            Err(fault) => first_fault = first_fault.or(Some(fault)),
        }
    }
    Err(first_fault.unwrap_or(Fault::Flat))
}

/// The triangles without those that have the same three corners as an earlier one, whichever way they are wound.
fn once_each(group: &Component) -> Component {
    let mut known = HashSet::with_capacity(group.triangles.len());
    let is_new = |triangle: &&[u32; 3]| {
        let mut corners = **triangle;
        corners.sort_unstable();
        known.insert(corners)
    };
    Component { points: group.points.clone(), triangles: group.triangles.iter().filter(is_new).copied().collect() }
}

/// Leaves out surfaces that an earlier one is the same as; returns how many triangles went with them.
fn leave_out_copies(surfaces: &mut Vec<Component>, tolerance: f32) -> usize {
    let tolerance = tolerance.max(f32::MIN_POSITIVE);
    let mut known: HashSet<Vec<[[i64; 3]; 3]>> = HashSet::new();
    let before: usize = surfaces.iter().map(|surface| surface.triangles.len()).sum();
    surfaces.retain(|surface| {
        let place = |i: u32| {
            let point = surface.points[i as usize];
            [0, 1, 2].map(|axis| f64::from(point[axis] / tolerance).round() as i64)
        };
        let sorted = |triangle: &[u32; 3]| {
            let mut corners = triangle.map(place);
            corners.sort_unstable();
            corners
        };
        let mut triangles: Vec<_> = surface.triangles.iter().map(sorted).collect();
        triangles.sort_unstable();
        known.insert(triangles)
    });
    before - surfaces.iter().map(|surface| surface.triangles.len()).sum::<usize>()
}

fn merged(groups: &[Component]) -> Component {
    let mut all = Component::default();
    for group in groups {
        let first = all.points.len() as u32;
        all.points.extend(&group.points);
        all.triangles.extend(group.triangles.iter().map(|triangle| triangle.map(|i| i + first)));
    }
    all
}

/// Joins corners that round to the same point; triangles that lose a corner are dropped.
fn weld(group: &Component, tolerance: f32) -> Component {
    let tolerance = f64::from(tolerance.max(f32::MIN_POSITIVE));
    let origin = group.points.first().copied().unwrap_or_else(Point::origin);
    let mut welded = Component::default();
    let mut known: HashMap<[i64; 3], u32> = HashMap::with_capacity(group.points.len());
    let index: Vec<u32> = group
        .points
        .iter()
        .map(|point| {
            let key = [0, 1, 2].map(|axis| (f64::from(point[axis] - origin[axis]) / tolerance).round() as i64);
            *known.entry(key).or_insert_with(|| {
                welded.points.push(*point);
                welded.points.len() as u32 - 1
            })
        })
        .collect();
    let joined = group.triangles.iter().map(|triangle| triangle.map(|i| index[i as usize]));
    welded.triangles = joined.filter(|[a, b, c]| a != b && b != c && c != a).collect();
    welded
}

/// The triangles on each edge, and whether they run along it from the smaller corner to the larger.
fn edge_map(triangles: &[[u32; 3]]) -> BTreeMap<(u32, u32), Vec<(usize, bool)>> {
    let mut edges: BTreeMap<(u32, u32), Vec<(usize, bool)>> = BTreeMap::new();
    for (at, [a, b, c]) in triangles.iter().enumerate() {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            edges.entry((*from.min(to), *from.max(to))).or_default().push((at, from < to));
        }
    }
    edges
}

/// The connected components of a closed surface, or where it is open.
fn closed(group: &Component) -> Result<Vec<Component>, Fault> {
    if group.triangles.is_empty() {
        return Err(Fault::Flat);
    }
    let edges = edge_map(&group.triangles);
    let mut open = edges.iter().filter(|(_, faces)| faces.len() % 2 == 1).map(|(edge, _)| edge);
    if let Some((a, b)) = open.next() {
        let edges = 1 + open.count();
        let first = nalgebra::center(&group.points[*a as usize], &group.points[*b as usize]);
        return Err(Fault::Open { edges, first });
    }
    let mut parent: Vec<u32> = (0..group.points.len() as u32).collect();
    fn root(parent: &mut [u32], mut i: u32) -> u32 {
        while parent[i as usize] != i {
            parent[i as usize] = parent[parent[i as usize] as usize];
            i = parent[i as usize];
        }
        i
    }
    for [a, b, c] in &group.triangles {
        for other in [b, c] {
            let (a, other) = (root(&mut parent, *a), root(&mut parent, *other));
            parent[a as usize] = other;
        }
    }
    let mut order: HashMap<u32, usize> = HashMap::new();
    let mut components: Vec<Component> = Vec::new();
    let mut index: Vec<Option<u32>> = vec![None; group.points.len()];
    for triangle in &group.triangles {
        let at = *order.entry(root(&mut parent, triangle[0])).or_insert_with(|| {
            components.push(Component::default());
            components.len() - 1
        });
        let component = &mut components[at];
        let own = triangle.map(|i| {
            *index[i as usize].get_or_insert_with(|| {
                component.points.push(group.points[i as usize]);
                component.points.len() as u32 - 1
            })
        });
        component.triangles.push(own);
    }
    Ok(components)
}

/// Turns triangles that are wound against their neighbours; returns how many (the smaller party, per surface).
fn make_winding_consistent(surface: &mut Component) -> usize {
    let edges = edge_map(&surface.triangles);
    // Triangles that meet at a plain edge are wound alike when they run along it in opposite directions.
    let mut neighbours: Vec<Vec<(usize, bool)>> = vec![Vec::new(); surface.triangles.len()];
    for faces in edges.values() {
        if let [(a, along_a), (b, along_b)] = faces[..] {
            neighbours[a].push((b, along_a == along_b));
            neighbours[b].push((a, along_a == along_b));
        }
    }
    let mut turn: Vec<Option<bool>> = vec![None; surface.triangles.len()];
    let mut total = 0;
    for start in 0..turn.len() {
        if turn[start].is_some() {
            continue;
        }
        turn[start] = Some(false);
        let (mut open, mut patch) = (vec![start], vec![start]);
        while let Some(at) = open.pop() {
            for &(next, differs) in &neighbours[at] {
                if turn[next].is_none() {
                    turn[next] = turn[at].map(|turned| turned != differs);
                    open.push(next);
                    patch.push(next);
                }
            }
        }
        let turned = patch.iter().filter(|at| turn[**at] == Some(true)).count();
        let majority = turned * 2 > patch.len();
        for at in patch {
            turn[at] = turn[at].map(|turned| turned != majority);
        }
        total += turned.min(turn.len() - turned);
    }
    for (triangle, turned) in surface.triangles.iter_mut().zip(turn) {
        if turned == Some(true) {
            triangle.swap(1, 2);
        }
    }
    total
}
