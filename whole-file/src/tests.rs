use super::*;

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

fn put(path: &Path, text: &str, existing: Existing) -> io::Result<()> {
    write(path, existing, |out| out.write_all(text.as_bytes()))
}

fn names(folder: &Path) -> Vec<String> {
    let names = fs::read_dir(folder).expect("a folder");
    names.map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned()).collect()
}

#[test]
fn a_failed_write_leaves_the_old_file_and_nothing_else() {
    let folder = folder();
    let path = folder.path().join("a.txt");
    put(&path, "old", Existing::Keep).expect("written");
    let failed = write(&path, Existing::Replace, |out| {
        out.write_all(&vec![b'x'; 1 << 20])?;
        Err(io::Error::other("disk full"))
    });
    assert_eq!(failed.expect_err("refused").to_string(), "disk full");
    assert_eq!(fs::read(&path).expect("the file"), b"old");
    assert_eq!(names(folder.path()), ["a.txt"]);
}

/// The message does not contain the temporary name.
#[test]
fn a_folder_that_is_not_there_is_told_by_its_name() {
    let folder = folder();
    let path = folder.path().join("none").join("a.txt");
    let told = put(&path, "new", Existing::Keep).expect_err("refused").to_string();
    assert_eq!(told, format!("there is no folder {}", path.parent().expect("a folder").display()));
}

#[test]
fn what_could_not_be_written_is_told_before() {
    let folder = folder();
    may_be_made(&folder.path().join("a.txt")).expect("a place");
    assert!(names(folder.path()).is_empty());
    for file in [folder.path().join("none").join("a.txt"), folder.path().join("a".repeat(300)), folder.path().into()] {
        assert!(may_be_made(&file).is_err(), "{file:?}");
        assert!(put(&file, "new", Existing::Keep).is_err(), "{file:?}");
    }
}

#[test]
fn a_file_is_kept_or_replaced_as_is_asked() {
    let folder = folder();
    let path = folder.path().join("a.txt");
    put(&path, "old", Existing::Keep).expect("written");
    assert_eq!(put(&path, "new", Existing::Keep).expect_err("kept").kind(), ErrorKind::AlreadyExists);
    assert_eq!(read(&path, FileKind::SETTINGS).as_deref(), Ok(&b"old"[..]));
    put(&path, "new", Existing::Replace).expect("written");
    assert_eq!(read_text(&path, FileKind::SETTINGS).as_deref(), Ok("new"));
    assert!(put(Path::new("/"), "", Existing::Replace).is_err());
    assert!(put(Path::new(""), "", Existing::Keep).is_err());
}

#[test]
fn what_was_left_behind_is_removed_and_what_is_being_written_is_not() {
    let folder = folder();
    let path = folder.path().join("a.txt");
    let left = folder.path().join(format!("{PREFIX}left{SUFFIX}"));
    fs::write(&left, "half").expect("a file");
    write(&path, Existing::Keep, |out| {
        assert!(!left.exists());
        out.write_all(b"outer")?;
        put(&folder.path().join("b.txt"), "inner", Existing::Keep)
    })
    .expect("written");
    let mut found = names(folder.path());
    found.sort();
    assert_eq!(found, ["a.txt", "b.txt"]);
    assert_eq!(fs::read(&path).expect("the file"), b"outer");
}

#[test]
fn a_file_that_is_absent_too_long_or_no_text_is_refused_in_words() {
    let folder = folder();
    let path = folder.path().join("a");
    assert_eq!(read(&path, FileKind::IMAGE), Err("there is no such file".into()));
    fs::write(&path, vec![b' '; (1 << 20) + 1]).expect("a file");
    assert_eq!(read(&path, FileKind::SETTINGS), Err("longer than 1 MiB: not a settings file".into()));
    assert!(read(&path, FileKind::IMAGE).is_ok());
    fs::write(&path, b"ab\xff").expect("a file");
    assert_eq!(read_text(&path, FileKind::SETTINGS), Err("not UTF-8 text (byte 3)".into()));
    assert_eq!(read(folder.path(), FileKind::SETTINGS), Err("this is a directory, expected a regular file".into()));
}

#[cfg(unix)]
mod unix {
    use std::os::unix::fs::{PermissionsExt, symlink};
    use std::os::unix::net::UnixListener;

    use super::*;

    fn mode(path: &Path) -> u32 {
        fs::metadata(path).expect("a file").permissions().mode() & 0o777
    }

    #[test]
    fn a_link_stays_and_leads_to_the_new_file() {
        let folder = folder();
        let [file, link, nowhere] = ["file", "link", "nowhere"].map(|name| folder.path().join(name));
        fs::write(&file, "old").expect("a file");
        symlink("file", &link).expect("a link");
        symlink("absent", &nowhere).expect("a link");
        put(&link, "new", Existing::Replace).expect("written");
        assert_eq!(fs::read_link(&link).expect("a link"), Path::new("file"));
        assert_eq!(fs::read(&file).expect("the file"), b"new");
        assert!(put(&nowhere, "new", Existing::Replace).is_err());
        assert!(fs::read_link(&nowhere).is_ok());
    }

    #[test]
    fn a_socket_is_neither_read_nor_replaced() {
        let folder = folder();
        let path = folder.path().join("socket");
        let _socket = UnixListener::bind(&path).expect("a socket");
        let told = "this is a socket, expected a regular file";
        assert_eq!(read(&path, FileKind::SETTINGS), Err(told.into()));
        assert_eq!(put(&path, "", Existing::Replace).expect_err("refused").to_string(), told);
        assert!(path.exists());
    }

    #[test]
    fn permissions_are_those_of_the_old_file_and_of_a_new_one_those_of_any() {
        let folder = folder();
        let [fresh, other] = ["fresh", "other"].map(|name| folder.path().join(name));
        put(&fresh, "", Existing::Keep).expect("written");
        fs::write(&other, "").expect("a file");
        assert_eq!(mode(&fresh), mode(&other));
        fs::set_permissions(&fresh, fs::Permissions::from_mode(0o750)).expect("ours");
        put(&fresh, "new", Existing::Replace).expect("written");
        assert_eq!(mode(&fresh), 0o750);
        fs::set_permissions(&fresh, fs::Permissions::from_mode(0o440)).expect("ours");
        assert_eq!(put(&fresh, "", Existing::Replace).expect_err("kept").kind(), ErrorKind::PermissionDenied);
    }

    #[test]
    fn a_folder_is_one_programs_until_it_lets_go() {
        let folder = folder();
        let path = folder.path().join("out");
        let first = claim(&path).expect("free");
        assert_eq!(claim(&path).expect_err("taken").kind(), ErrorKind::ResourceBusy);
        put(&path.join("a"), "", Existing::Keep).expect("written");
        drop(first);
        assert!(claim(&path).is_ok());
        assert_eq!(names(&path), ["a"]);
    }
}
