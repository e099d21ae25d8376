//! What a file holds, by its content. Its name only says what it should be.

use super::MeshError;
use super::stl;
use super::text::{is_text, lines, quoted, words};

/// What a file holds.
enum Content {
    /// A mesh, by the ending that its format has.
    Mesh(&'static str),
    /// Something else, and what to do.
    Other(&'static str, &'static str),
    /// Nothing that is recognised.
    Unknown,
}

const UNPACK: &str = "unpack it, and name the mesh in it";
const ZIP: &str = "unpack it, and name the mesh in it; of a 3MF file: \
                   python -c \"import trimesh; trimesh.load('part.3mf', force='mesh').export('part.stl')\"";
const EXPORT: &str = "export the part as binary STL in millimetres";
const CONVERT: &str =
    "convert it: python -c \"import trimesh; trimesh.load('part.3mf', force='mesh').export('part.stl')\"";
const DOWNLOAD: &str = "download the file itself: on GitHub, the button `Raw` or `git lfs pull`";

/// How files begin that are no meshes, or none that is read; capitals do not count.
const BEGINNINGS: [(&[u8], &str, &str); 27] = [
    (
        b"version https://git-lfs",
        "a Git LFS pointer, which stands for a file elsewhere",
        "`git lfs pull` fetches the file",
    ),
    (b"PK\x03\x04", "a zip archive (3MF files are zip archives)", ZIP),
    (b"\x1f\x8b", "a gzip file", UNPACK),
    (b"7z\xbc\xaf", "a 7z archive", UNPACK),
    (b"Rar!", "a RAR archive", UNPACK),
    (b"BZh", "a bzip2 file", UNPACK),
    (b"\xfd7zXZ", "an xz file", UNPACK),
    (b"\x28\xb5\x2f\xfd", "a zstd file", UNPACK),
    (b"<!doctype html", "a web page", DOWNLOAD),
    (b"<html", "a web page", DOWNLOAD),
    (b"<", "an XML file (COLLADA, X3D and AMF are)", CONVERT),
    (b"ISO-10303-21", "a STEP file: curved surfaces and no triangles", EXPORT),
    (b"\xd0\xcf\x11\xe0", "a compound file (parts of SolidWorks and Inventor are)", EXPORT),
    (b"DBRep_DrawableShape", "an OpenCASCADE file: curved surfaces and no triangles", EXPORT),
    (b"Kaydara FBX", "an FBX file", CONVERT),
    (b"; FBX", "an FBX file", CONVERT),
    (b"BLENDER", "a Blender file", "export the part from Blender as STL, OBJ, PLY or GLB"),
    (b"OFF\n", "an OFF mesh", CONVERT),
    (b"OFF\r", "an OFF mesh", CONVERT),
    (b"#VRML", "a VRML file", CONVERT),
    (b"# vtk", "a VTK file", CONVERT),
    (b"AC10", "a DWG drawing", EXPORT),
    (b"\x89PNG", "a PNG picture", EXPORT),
    (b"\xff\xd8\xff", "a JPEG picture", EXPORT),
    (b"%PDF", "a PDF document", EXPORT),
    (b"\xff\xfe", "text in UTF-16", "save it as UTF-8"),
    (b"\xfe\xff", "text in UTF-16", "save it as UTF-8"),
];

/// Words with which a line of an OBJ file begins.
const OBJ_WORDS: [&[u8]; 14] =
    [b"v", b"vt", b"vn", b"vp", b"f", b"l", b"p", b"o", b"g", b"s", b"mtllib", b"usemtl", b"cstype", b"deg"];

/// Refuses a file that holds something else than its name says.
pub(super) fn check(bytes: &[u8], extension: &'static str) -> Result<(), MeshError> {
    let named = extension.to_ascii_uppercase();
    match content(bytes) {
        Content::Mesh(found) if found == extension => Ok(()),
        Content::Mesh(found) => Err(MeshError::file(format!(
            "this is {} mesh, and its name says {named}",
            article(&found.to_ascii_uppercase())
        ))
        .with_hint(match found {
            "stl" => "rename it so that it ends in .stl",
            "obj" => "rename it so that it ends in .obj",
            "ply" => "rename it so that it ends in .ply",
            _ => "rename it so that it ends in .glb",
        })),
        Content::Other(found, hint) => {
            Err(MeshError::file(format!("this is {found}, and no {named} mesh")).with_hint(hint))
        }
        // A binary STL file has no mark, nor has an OBJ file that begins with words of its writer.
        Content::Unknown if extension == "stl" && !is_text(bytes) => Ok(()),
        Content::Unknown if extension == "obj" && is_text(bytes) => Ok(()),
        Content::Unknown => {
            let size = bytes.len();
            let begins = match first_word(bytes) {
                Some((line, word)) if is_text(bytes) => {
                    format!("text whose line {line} begins with {}", quoted(word))
                }
                _ => "not text".into(),
            };
            Err(MeshError::file(format!("this is no {named} mesh: {size} bytes, {begins}")))
        }
    }
}

/// `a` or `an` before the name of a format, which is spelt out when read.
fn article(format: &str) -> String {
    let an = format.starts_with(['O', 'S']);
    format!("{} {format}", if an { "an" } else { "a" })
}

fn content(bytes: &[u8]) -> Content {
    if stl::is_binary(bytes) {
        return Content::Mesh("stl");
    }
    if bytes.iter().all(|&b| b == 0) {
        return Content::Other("a file of zero bytes only", "copy or download it again");
    }
    if bytes.starts_with(b"glTF") {
        return Content::Mesh("glb");
    }
    if bytes.starts_with(b"ply") && bytes.get(3).is_some_and(u8::is_ascii_whitespace) {
        return Content::Mesh("ply");
    }
    let text = bytes.trim_ascii_start();
    let begins = |start: &[u8]| text.get(..start.len()).is_some_and(|b| b.eq_ignore_ascii_case(start));
    if let Some((_, found, hint)) = BEGINNINGS.iter().find(|(start, ..)| begins(start)) {
        return Content::Other(found, hint);
    }
    if !is_text(bytes) {
        return Content::Unknown;
    }
    let Some((_, word)) = first_word(bytes) else {
        return Content::Other("a file without a word", "export the part again");
    };
    match word {
        _ if word.eq_ignore_ascii_case(b"solid") => Content::Mesh("stl"),
        _ if word.starts_with(b"{") => {
            Content::Other("a file of JSON (glTF as text is)", "export it as GLB, binary glTF in one file")
        }
        _ if OBJ_WORDS.contains(&word) => Content::Mesh("obj"),
        _ => Content::Unknown,
    }
}

/// The first word that stands in no comment, and its line.
fn first_word(bytes: &[u8]) -> Option<(usize, &[u8])> {
    let mut first = lines(bytes).filter_map(|(number, line)| Some((number, words(line).next()?)));
    first.find(|(_, word)| !word.starts_with(b"#") && !word.starts_with(b";"))
}
