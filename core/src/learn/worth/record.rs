//! How a state is filed: [`LAYOUT`].

use super::blocks;
use super::state::{
    BANDS, BeliefMap, FloorFacts, Followed, MapScores, ObjectOutcome, ObjectState, Promise, WorthPush, WorthState,
};
use crate::grid::{Grid, Voxel};
use crate::learn::bytes::{Reader, put_set};
use crate::learn::{Kind, Record};
use crate::scene::{CLASS_COUNT, Family, MAX_OBJECTS, ObjectId};
use crate::skill::Push;
use crate::skill::PushSampler;

/// What a record holds, in order: name, type, shape. `u1` is a byte, `i1` one with a sign; a bit is packed lowest first.
pub const LAYOUT: [&str; 10] = [
    "seed u8; leg u1; family u1 (mixed crowded walls rows rings tall-first halves chambers); noisy u1; earlier_pushes u1; \
     look_count u2; looks u2[look_count] (views)",
    "igv f4 (nats); occupancy_iou f4; semantic_miou f4; the same two after three more looks f4[2] (NaN: not found)",
    "occupancy u1[x y z] (mean p, 255ths); deviation u1[x y z] (mean standard deviation, 510ths); seen u1[x y z] (voxels of 8); \
     reached u1[x y z] (voxels of 8 that some view reaches through the likeliest map)",
    "class u1[X Y]; certainty u1[X Y] (255ths); entropy u1[X Y] (255ths of ln 15); vacuity u1[X Y] (255ths)",
    "truth bit[X Y Z] (words of 64); labels u1[X Y]",
    "object_count u2; per object: id u2, class u1, hidden u1, shown u4 (voxels that every fourth view reaches), pose f4[7] (x y z m, i j k w)",
    "push_count u2; then per push the following",
    "start f4[3] (m); direction f4 (degrees); length f4 (m); contact u2[3] (voxel); sampler u1 (0 frontier, 1 hidden); \
     motion f4 (s); swept bit[x y z]",
    "promised gain f4, reg f4 (nats); change u1[x y] (probability, 255ths); occupancy change i1[u v 8] (127ths, bands of an \
     eighth of the height)",
    "pushed f4 (m); jammed u1; displacement f4 (m); opened u4 (voxels); opened_nats f4; toppled u1; occupancy_iou f4 and \
     semantic_miou f4 after it and two looks (NaN: not found); per object: flags u1 (1 hidden, 2 dropped), shown u4",
];

/// Bytes that are appended to.
struct Writer(Vec<u8>);

impl Writer {
    fn u8(&mut self, value: u8) {
        self.0.push(value);
    }

    fn u16(&mut self, value: u16) {
        self.0.extend(value.to_le_bytes());
    }

    fn u32(&mut self, value: u32) {
        self.0.extend(value.to_le_bytes());
    }

    fn f32(&mut self, value: f32) {
        self.0.extend(value.to_le_bytes());
    }

    fn scores(&mut self, scores: Option<MapScores>) {
        let nothing = MapScores { occupancy_iou: f32::NAN, semantic_miou: f32::NAN };
        let scores = scores.unwrap_or(nothing);
        self.f32(scores.occupancy_iou);
        self.f32(scores.semantic_miou);
    }

    fn push(&mut self, push: &WorthPush) {
        let Push { start, direction_deg, length_m } = push.push;
        start.into_iter().chain([direction_deg, length_m]).for_each(|number| self.f32(number));
        [push.contact.x, push.contact.y, push.contact.z].into_iter().for_each(|at| self.u16(at));
        self.u8(PushSampler::ALL.iter().position(|one| *one == push.sampler).unwrap_or(0) as u8);
        self.f32(push.motion_s);
        self.0.extend(&push.swept);
        self.f32(push.promise.gain);
        self.f32(push.promise.reg);
        self.0.extend(&push.promise.change);
        self.0.extend(push.promise.occupancy.iter().map(|change| *change as u8));
        self.f32(push.pushed_m);
        self.u8(u8::from(push.jammed));
        self.f32(push.displacement_m);
        self.u32(push.opened);
        self.f32(push.opened_nats);
        self.u8(push.toppled);
        self.scores(push.followed.map(|followed| followed.scores));
        for object in &push.objects {
            self.u8(u8::from(object.hidden) + 2 * u8::from(object.dropped));
            self.u32(object.shown);
        }
    }
}

fn scores(reader: &mut Reader<'_>) -> Option<Option<MapScores>> {
    let scores = MapScores { occupancy_iou: reader.f32()?, semantic_miou: reader.f32()? };
    Some((!scores.occupancy_iou.is_nan()).then_some(scores))
}

fn flag(reader: &mut Reader<'_>) -> Option<bool> {
    match reader.u8()? {
        0 => Some(false),
        1 => Some(true),
        _ => None,
    }
}

fn push(grid: &Grid, objects: usize, reader: &mut Reader<'_>) -> Option<WorthPush> {
    let [width, depth, height] = blocks::dims(grid);
    let [coarse_x, coarse_y] = blocks::coarse_dims(grid);
    let start = [reader.f32()?, reader.f32()?, reader.f32()?];
    let push = Push { start, direction_deg: reader.f32()?, length_m: reader.f32()? };
    let contact = Voxel { x: reader.u16()?, y: reader.u16()?, z: reader.u16()? };
    let sampler = *PushSampler::ALL.get(usize::from(reader.u8()?))?;
    let motion_s = reader.f32()?;
    let swept = reader.take((width * depth * height).div_ceil(8))?.to_vec();
    let (gain, reg) = (reader.f32()?, reader.f32()?);
    let change = reader.take(width * depth)?.to_vec();
    let occupancy = reader.take(coarse_x * coarse_y * BANDS)?.iter().map(|byte| *byte as i8).collect();
    Some(WorthPush {
        push,
        contact,
        sampler,
        motion_s,
        swept,
        promise: Promise { gain, reg, change, occupancy },
        pushed_m: reader.f32()?,
        jammed: flag(reader)?,
        displacement_m: reader.f32()?,
        opened: reader.u32()?,
        opened_nats: reader.f32()?,
        toppled: reader.u8()?,
        followed: scores(reader)?.map(|scores| Followed { scores }),
        objects: (0..objects)
            .map(|_| {
                let flags = reader.u8().filter(|flags| *flags < 4)?;
                Some(ObjectOutcome { hidden: flags & 1 == 1, dropped: flags & 2 == 2, shown: reader.u32()? })
            })
            .collect::<Option<_>>()?,
    })
}

impl Record for WorthState {
    const KIND: Kind = Kind::Worth;

    fn to_bytes(&self) -> Vec<u8> {
        let mut out = Writer(self.seed.to_le_bytes().to_vec());
        out.u8(self.leg);
        out.u8(Family::ALL.iter().position(|one| *one == self.family).unwrap_or(0) as u8);
        out.u8(u8::from(self.noisy));
        out.u8(self.earlier_pushes);
        out.u16(self.looks.len() as u16);
        self.looks.iter().for_each(|view| out.u16(*view));
        out.f32(self.igv);
        out.scores(Some(self.scores));
        out.scores(self.looked_on);
        let (map, floor) = (&self.map, &self.floor);
        for plane in [&map.occupancy, &map.deviation, &map.seen, &map.reached] {
            out.0.extend(plane);
        }
        for plane in [&floor.class, &floor.certainty, &floor.entropy, &floor.vacuity] {
            out.0.extend(plane);
        }
        put_set(&mut out.0, &self.truth);
        out.0.extend(&self.labels);
        out.u16(self.objects.len() as u16);
        for object in &self.objects {
            out.u16(object.id.0);
            out.u8(object.class);
            out.u8(u8::from(object.hidden));
            out.u32(object.shown);
            object.pose.into_iter().for_each(|number| out.f32(number));
        }
        out.u16(self.pushes.len() as u16);
        self.pushes.iter().for_each(|push| out.push(push));
        out.0
    }

    fn from_bytes(grid: &Grid, bytes: &[u8]) -> Option<Self> {
        let mut reader = Reader::new(grid, bytes);
        let (seed, leg) = (reader.u64()?, reader.u8()?);
        let family = *Family::ALL.get(usize::from(reader.u8()?))?;
        let (noisy, earlier_pushes) = (flag(&mut reader)?, reader.u8()?);
        let look_count = reader.u16()?;
        let looks = (0..look_count).map(|_| reader.u16()).collect::<Option<Vec<_>>>()?;
        let igv = reader.f32()?;
        let (now, looked_on) = (scores(&mut reader)?, scores(&mut reader)?);
        let count = blocks::dims(grid).iter().product();
        let mut map = || Some(reader.take(count)?.to_vec());
        let map = BeliefMap { occupancy: map()?, deviation: map()?, seen: map()?, reached: map()? };
        let mut floor = || reader.floor();
        let floor = FloorFacts { class: floor()?, certainty: floor()?, entropy: floor()?, vacuity: floor()? };
        let (truth, labels) = (reader.set()?, reader.floor()?);
        let is_class = |class: &u8| usize::from(*class) < CLASS_COUNT;
        if !labels.iter().chain(&floor.class).all(is_class) {
            return None;
        }
        let object_count = Some(usize::from(reader.u16()?)).filter(|count| *count <= MAX_OBJECTS)?;
        let object = |reader: &mut Reader<'_>| {
            let (id, class) = (ObjectId(reader.u16()?), reader.u8().filter(is_class)?);
            let (hidden, shown) = (flag(reader)?, reader.u32()?);
            let mut pose = [0.0; 7];
            for number in &mut pose {
                *number = reader.f32()?;
            }
            Some(ObjectState { id, class, hidden, shown, pose })
        };
        let objects = (0..object_count).map(|_| object(&mut reader)).collect::<Option<Vec<_>>>()?;
        let push_count = reader.u16()?;
        let pushes = (0..push_count).map(|_| push(grid, object_count, &mut reader)).collect::<Option<Vec<_>>>()?;
        reader.is_done().then_some(Self {
            seed,
            leg,
            family,
            noisy,
            looks,
            earlier_pushes,
            igv,
            scores: now.unwrap_or_default(),
            looked_on,
            map,
            floor,
            truth,
            labels,
            objects,
            pushes,
        })
    }
}
