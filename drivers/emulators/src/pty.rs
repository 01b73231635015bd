//! A pseudo-terminal whose other end a client opens like a serial port.
//!
//! It is read with plain `read(2)`: when a client closes right after its last command, a serial library reports the
//! hang-up and loses that command, which may be the one that stops the axis.

use rustix::fs::{Mode, OFlags, fcntl_setfl, open};
use rustix::io::Errno;
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};
use std::fs;
use std::io;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};

/// The emulator's end.
#[derive(Debug)]
pub struct Pty {
    master: OwnedFd,
    /// The client's end, such as `/dev/pts/3`.
    pub path: PathBuf,
    link: Option<PathBuf>,
    /// Whether a client had it open at the newest read.
    pub has_client: bool,
}

impl Pty {
    /// Opens a raw pseudo-terminal, with a link to it where a path is given. It replaces a link of an earlier run;
    /// anything else at that path is an error.
    pub fn open(link: Option<&Path>) -> io::Result<Self> {
        let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC)?;
        grantpt(&master)?;
        unlockpt(&master)?;
        let name = ptsname(&master, Vec::new())?;
        let path = PathBuf::from(name.to_string_lossy().into_owned());
        fcntl_setfl(&master, OFlags::NONBLOCK)?;
        // Without this the terminal would echo what the emulator sends before a client opens it.
        let client = open(&path, OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC, Mode::empty())?;
        let mut attributes = tcgetattr(&client)?;
        attributes.make_raw();
        tcsetattr(&client, OptionalActions::Now, &attributes)?;
        if let Some(link) = link {
            if fs::symlink_metadata(link).is_ok_and(|entry| entry.file_type().is_symlink()) {
                fs::remove_file(link)?;
            }
            symlink(&path, link)?;
        }
        Ok(Self { master, path, link: link.map(Path::to_owned), has_client: false })
    }

    /// Bytes that have arrived; none without a client.
    pub fn read(&mut self) -> Vec<u8> {
        let mut all = Vec::new();
        let mut part = [0_u8; 4096];
        loop {
            match rustix::io::read(&self.master, &mut part) {
                Ok(0) | Err(Errno::IO) => {
                    self.has_client = false;
                    return all;
                }
                Ok(count) => {
                    self.has_client = true;
                    all.extend_from_slice(&part[..count]);
                    if count < part.len() {
                        return all;
                    }
                }
                Err(Errno::INTR) => {}
                // Nothing to read, and a client has it open.
                Err(_) => {
                    self.has_client = true;
                    return all;
                }
            }
        }
    }

    /// Sends as much as fits and returns how much that is. Without a client bytes vanish, as on a line without a plug.
    pub fn write(&mut self, bytes: &[u8]) -> usize {
        if !self.has_client {
            return bytes.len();
        }
        match rustix::io::write(&self.master, bytes) {
            Ok(count) => count,
            Err(Errno::IO) => bytes.len(),
            Err(_) => 0,
        }
    }
}

impl AsFd for Pty {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.master.as_fd()
    }
}

impl Drop for Pty {
    fn drop(&mut self) {
        if let Some(link) = &self.link
            && fs::read_link(link).is_ok_and(|target| target == self.path)
        {
            // What cannot be removed now is replaced by the next run.
            let _ = fs::remove_file(link);
        }
    }
}
