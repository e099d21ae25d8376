//! The protobuf messages and their descriptors.
//!
//! Rust code and descriptors are generated from `proto/` and committed, so that building needs no protobuf compiler;
//! a test keeps them fresh. `GRIPGEN_UPDATE=1 cargo test -p gripgen-record generated` writes them anew.

/// gripgen's own messages.
#[allow(missing_docs, clippy::all, unused_qualifications, reason = "generated code")]
pub mod gripgen_v1 {
    include!("proto/gripgen.v1.rs");
}

/// Messages of Foxglove's schemas.
#[allow(missing_docs, clippy::all, unused_qualifications, reason = "generated code")]
pub mod foxglove {
    include!("proto/foxglove.rs");
}

/// `FileDescriptorSet` of `gripgen/v1/pull.proto` and what it imports.
pub const PULL_DESCRIPTOR: &[u8] = include_bytes!("proto/gripgen.v1.pull.bin");
/// `FileDescriptorSet` of `gripgen/v1/rig.proto` and what it imports.
pub const RIG_DESCRIPTOR: &[u8] = include_bytes!("proto/gripgen.v1.rig.bin");
/// `FileDescriptorSet` of `gripgen/v1/film.proto` and what it imports.
pub const FILM_DESCRIPTOR: &[u8] = include_bytes!("proto/gripgen.v1.film.bin");
/// `FileDescriptorSet` of `foxglove/CompressedImage.proto` and what it imports.
pub const COMPRESSED_IMAGE_DESCRIPTOR: &[u8] = include_bytes!("proto/foxglove.CompressedImage.bin");
/// `FileDescriptorSet` of `foxglove/RawImage.proto` and what it imports.
pub const RAW_IMAGE_DESCRIPTOR: &[u8] = include_bytes!("proto/foxglove.RawImage.bin");

#[cfg(test)]
mod tests {
    use prost::Message;
    use std::path::Path;

    fn check(name: &str, fresh: &[u8]) {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/proto").join(name);
        if std::env::var_os("GRIPGEN_UPDATE").is_some() {
            std::fs::write(&path, fresh).unwrap();
        }
        let committed = std::fs::read(&path).unwrap_or_default();
        assert!(
            committed == fresh,
            "{name} is stale: GRIPGEN_UPDATE=1 cargo test -p gripgen-record generated"
        );
    }

    #[test]
    fn generated_code_and_descriptors_are_fresh() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("proto");
        let files = [
            "gripgen/v1/pull.proto",
            "gripgen/v1/rig.proto",
            "gripgen/v1/film.proto",
            "foxglove/CompressedImage.proto",
            "foxglove/RawImage.proto",
        ];
        let names = [
            "gripgen.v1.pull",
            "gripgen.v1.rig",
            "gripgen.v1.film",
            "foxglove.CompressedImage",
            "foxglove.RawImage",
        ];
        for (file, name) in files.iter().zip(names) {
            let mut set = protox::compile([root.join(file)], [&root]).unwrap();
            for descriptor in &mut set.file {
                // Comments do not belong into every data file.
                descriptor.source_code_info = None;
            }
            check(&format!("{name}.bin"), &set.encode_to_vec());
        }
        let out = tempfile::tempdir().unwrap();
        let all = protox::compile(files.map(|f| root.join(f)), [&root]).unwrap();
        prost_build::Config::new().btree_map(["."]).out_dir(out.path()).compile_fds(all).unwrap();
        for name in ["gripgen.v1.rs", "foxglove.rs"] {
            check(name, &std::fs::read(out.path().join(name)).unwrap());
        }
    }
}
