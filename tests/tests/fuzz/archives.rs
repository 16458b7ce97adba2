//! Arrays in files: NumPy archives, weights, and the cards of weights and data.

use super::engine::Target;
use super::episodes::episode;
use nudge_core::episode::EpisodeDir;
use nudge_core::learn;
use nudge_tests::{Folder, root};

/// CRC-32 as zip archives have it.
fn crc32(bytes: &[u8]) -> u32 {
    let step = |crc: u32, _| if crc & 1 == 1 { crc >> 1 ^ 0xedb8_8320 } else { crc >> 1 };
    !bytes.iter().fold(!0, |crc, byte| (0..8).fold(crc ^ u32::from(*byte), step))
}

/// A zip archive whose entries are stored as they are.
fn zip(entries: &[(&str, &[u8])]) -> Vec<u8> {
    let (mut file, mut directory) = (Vec::new(), Vec::new());
    for (name, content) in entries {
        let offset = file.len() as u32;
        let mut head: Vec<u8> = [20_u16, 0, 0, 0, 0].iter().flat_map(|word| word.to_le_bytes()).collect();
        for word in [crc32(content), content.len() as u32, content.len() as u32] {
            head.extend(word.to_le_bytes());
        }
        head.extend((name.len() as u16).to_le_bytes());
        head.extend([0; 2]);
        file.extend(b"PK\x03\x04");
        file.extend(&head);
        file.extend(name.as_bytes());
        file.extend(*content);
        directory.extend(b"PK\x01\x02\x14\x00");
        directory.extend(&head);
        directory.extend([0; 10]);
        directory.extend(offset.to_le_bytes());
        directory.extend(name.as_bytes());
    }
    let (at, length, count) = (file.len() as u32, directory.len() as u32, entries.len() as u16);
    file.extend(directory);
    file.extend(b"PK\x05\x06\0\0\0\0");
    file.extend([count.to_le_bytes(), count.to_le_bytes()].concat());
    file.extend([length.to_le_bytes(), at.to_le_bytes()].concat());
    file.extend([0; 2]);
    file
}

/// A `.npy` of this header, all of its numbers 1.
fn npy(header: &[u8], numbers: usize) -> Vec<u8> {
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header);
    bytes.extend([0, 0x3c].repeat(numbers));
    bytes
}

#[test]
fn beliefs() {
    let (_folder, path) = episode();
    let file = path.join("beliefs/001.npz");
    let sound = std::fs::read(&file).expect("a belief");
    let read = |bytes: &[u8]| {
        std::fs::write(&file, bytes).expect("written");
        let Ok(directory) = EpisodeDir::open(&path) else { return false };
        directory.read_belief(1).is_ok()
    };
    let words = ["PK\x01\x02", "PK\x03\x04", "PK\x05\x06", "PK\x06\x06", "PK\x06\x07", "NUMPY"];
    Target { name: "npz", sound: vec![sound], words: &words, inputs: 300 }.run(read);

    let header = |shape: &str| {
        format!("{{'descr': '<f2', 'fortran_order': False, 'shape': ({shape}), }}          \n").into_bytes()
    };
    let semantics = npy(&header("30, 20, 15"), 30 * 20 * 15);
    let words = ["<f4", "<f8", "|u1", ">f2", "True", "(", ")", "[", "'", "[('a', '<f2')]", "99999999999999999999", "O"];
    let target = Target { name: "npz by its header", sound: vec![header("30, 20, 20, 2")], words: &words, inputs: 300 };
    target.run(|header| {
        let occupancy = npy(header, 30 * 20 * 20 * 2);
        read(&zip(&[("occupancy.npy", &occupancy), ("semantics.npy", &semantics)]))
    });
}

#[test]
fn cards_of_data() {
    let folder = Folder::new();
    let card = "format = 2\nkind = \"maps\"\nversion = \"0.1.0\"\nseed = 1\ncount = 100\nsamples_per_shard = 50\n\
        views_per_sample = 10\nview_array = \"standard300\"\ndims = [160, 80, 80]\nvoxel_m = 0.005\nclasses = [\"a\"]\n\
        fill = [0.2, 0.4]\nrho = 0.5\nnoise_share = 0.25\n";
    let path = folder.path("card.toml");
    let target =
        Target { name: "card of data", sound: vec![card.into()], words: &["nan", "inf", "[", "]"], inputs: 200 };
    target.run(|file| {
        std::fs::write(&path, file).expect("written");
        let Ok(Some(card)) = learn::Card::read(path.parent().expect("a folder")) else { return false };
        let _ = (card.shard_count(), card.shard_samples(0), card.grid());
        true
    });
}

#[cfg(feature = "cnabu")]
mod weights {
    use super::*;
    use nudge_core::cnabu::{Card, ObserveNet, Tensor, load_network, read_tensors, write_tensors};

    /// What a sound file begins with, and all that follows.
    fn parts(file: &[u8]) -> (Vec<u8>, Vec<u8>) {
        let size = u64::from_le_bytes(file[..8].try_into().expect("8 bytes")) as usize;
        (file[8..8 + size].to_vec(), file[8 + size..].to_vec())
    }

    #[test]
    fn safetensors() {
        let folder = Folder::new();
        let path = folder.path("weights.safetensors");
        let named = |name: &str, tensor: Tensor| (name.to_owned(), tensor);
        let tensors = [
            named("a", Tensor::from_slice(&[1.0_f32, 2.0, 3.0, 4.0]).view([2, 2])),
            named("b", Tensor::from_slice(&[1_i64, 2])),
            named("c", Tensor::from_slice(&[1.0_f32; 6]).to_kind(nudge_core::cnabu::half(&Tensor::from(0.0)).kind())),
        ];
        write_tensors(&path, &tensors).expect("written");
        let sound = std::fs::read(&path).expect("weights");
        let read = |bytes: &[u8]| {
            std::fs::write(&path, bytes).expect("written");
            let Ok(tensors) = read_tensors(&path) else { return false };
            // All of it is there to be read.
            tensors.values().for_each(|tensor| drop(tensor.sum(nudge_core::cnabu::half(tensor).kind())));
            true
        };
        let words = ["F32", "F16", "I64", "BF16", "[]", "[0,0]", "\"__metadata__\":{},", "null", "-1"];
        Target { name: "safetensors", sound: vec![sound.clone()], words: &words, inputs: 200 }.run(read);
        let (header, numbers) = parts(&sound);
        let target = Target { name: "safetensors by header", sound: vec![header], words: &words, inputs: 300 };
        target.run(|header| read(&[&(header.len() as u64).to_le_bytes(), header, &numbers].concat()));
    }

    #[test]
    fn cards_of_weights() {
        let folder = Folder::new();
        let weights = folder.path("sigma_o.safetensors");
        let card = std::fs::read(root().join("models/sigma_o.toml")).expect("a shipped card");
        // What it says of the network is read whether or not the weights go with it.
        write_tensors(&weights, &[("a".to_owned(), Tensor::from_slice(&[1.0_f32; 8]))]).expect("written");
        let words = ["nan", "inf", "[", "]", "change_temperature = 0\n", "width = 512\n", "\n[[score]]\n"];
        Target { name: "card of weights", sound: vec![card], words: &words, inputs: 100 }.run(|file| {
            std::fs::write(weights.with_extension("toml"), file).expect("written");
            let read = Card::read(&weights, "sigma_o").is_ok();
            let loaded = load_network::<ObserveNet>(&weights, nudge_core::cnabu::Device::Cpu);
            assert!(loaded.is_err(), "these are no weights of a network");
            read
        });
    }
}
