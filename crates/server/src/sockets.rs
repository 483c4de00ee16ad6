//! Opening the addresses of a server, and leaving no socket file behind.

use super::authentication::Guard;
use super::connection::{Connection, Connections};
use super::server::ServeError;
use super::shutdown::Shutdown;
use bimorph_wire::address::Address;
use std::fs;
use std::io;
use std::os::unix::fs::{FileTypeExt, MetadataExt, PermissionsExt};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;
use tokio::net::{TcpListener, TcpStream, UnixListener, UnixStream};
use tokio::sync::{OwnedSemaphorePermit, mpsc};

/// Pause after a failed accept (no file descriptors left, say), so that it does not spin.
const ACCEPT_PAUSE: Duration = Duration::from_millis(50);

/// A socket that was just accepted.
enum AcceptedSocket {
    Tcp(TcpStream),
    Unix(UnixStream),
}

/// An open listener with its address as bound.
pub(super) enum Listener {
    Tcp(TcpListener, Address),
    Unix(UnixListener, SocketFile),
}

impl Listener {
    /// Opens an address. With TLS, every TCP address speaks it.
    pub(super) async fn bind(address: &Address, insecure: bool, guard: &Guard) -> Result<Self, ServeError> {
        let refused = |reason| ServeError::Bind { address: address.clone(), reason };
        match address {
            Address::Tls { .. } if !guard.speaks_tls() => Err(ServeError::NoTls { address: address.clone() }),
            Address::Tcp(socket) | Address::Tls { socket, .. } => {
                if !socket.ip().is_loopback() && !insecure && !guard.is_enough() {
                    return Err(ServeError::NotLoopback { address: address.clone() });
                }
                let listener = TcpListener::bind(socket).await.map_err(refused)?;
                let socket = listener.local_addr().map_err(refused)?;
                let bound = match address {
                    Address::Tls { host, .. } => Address::Tls { host: host.clone(), socket },
                    _ if guard.speaks_tls() => Address::Tls { host: socket.ip().to_string(), socket },
                    _ => Address::Tcp(socket),
                };
                Ok(Self::Tcp(listener, bound))
            }
            Address::Unix(path) => {
                clear_stale(address, path)?;
                let (listener, file) = bind_private(path).map_err(|reason| match reason.kind() {
                    io::ErrorKind::AlreadyExists => ServeError::InUse { address: address.clone() },
                    _ => refused(reason),
                })?;
                Ok(Self::Unix(listener, file))
            }
        }
    }

    /// The address as bound.
    pub(super) fn address(&self) -> Address {
        match self {
            Self::Tcp(_, address) => address.clone(),
            Self::Unix(_, file) => Address::Unix(file.path.clone()),
        }
    }

    /// Accepts until draining starts; the socket file goes with the listener.
    pub(super) async fn accept(
        self,
        connections: Arc<Connections>,
        guard: Arc<Guard>,
        shutdown: Shutdown,
        accepted: mpsc::Sender<io::Result<Connection>>,
    ) {
        loop {
            let next = tokio::select! {
                next = self.next(&connections) => next,
                () = shutdown.draining.cancelled() => return,
            };
            match next {
                Ok(Some((AcceptedSocket::Unix(socket), place))) => {
                    if accepted.send(Ok(connections.unix(socket, place))).await.is_err() {
                        return;
                    }
                }
                Ok(Some((AcceptedSocket::Tcp(socket), place))) => {
                    // a handshake waits for its client without blocking others
                    let (connections, guard, accepted) =
                        (Arc::clone(&connections), Arc::clone(&guard), accepted.clone());
                    tokio::spawn(async move {
                        if let Some(connection) = connections.tcp(socket, &guard, place).await {
                            let _ = accepted.send(Ok(connection)).await;
                        }
                    });
                }
                Ok(None) => tracing::warn!("connection refused: the limit is reached"),
                Err(error) => {
                    tracing::warn!(%error, "accept failed");
                    tokio::time::sleep(ACCEPT_PAUSE).await;
                }
            }
        }
    }

    /// One connection; none when there is no place for it.
    async fn next(&self, connections: &Connections) -> io::Result<Option<(AcceptedSocket, OwnedSemaphorePermit)>> {
        match self {
            Self::Tcp(listener, _) => {
                let (socket, _) = listener.accept().await?;
                connections.prepare(&socket)?;
                Ok(connections.place().await.map(|place| (AcceptedSocket::Tcp(socket), place)))
            }
            Self::Unix(listener, _) => {
                let (socket, _) = listener.accept().await?;
                Ok(connections.place().await.map(|place| (AcceptedSocket::Unix(socket), place)))
            }
        }
    }
}

/// A socket's file, removed when the server closes it, unless another server has replaced it.
pub(super) struct SocketFile {
    path: PathBuf,
    device: u64,
    inode: u64,
}

impl Drop for SocketFile {
    fn drop(&mut self) {
        let ours = |m: fs::Metadata| m.dev() == self.device && m.ino() == self.inode;
        if fs::symlink_metadata(&self.path).is_ok_and(ours) {
            let _ = fs::remove_file(&self.path);
        }
    }
}

/// Removes the socket of a server that has ended; refuses to touch a live one or any other file.
fn clear_stale(address: &Address, path: &Path) -> Result<(), ServeError> {
    let refused = |reason| ServeError::Bind { address: address.clone(), reason };
    match fs::symlink_metadata(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
        Err(error) => return Err(refused(error)),
        Ok(found) if !found.file_type().is_socket() => {
            return Err(ServeError::NotASocket { address: address.clone() });
        }
        Ok(_) => {}
    }
    match std::os::unix::net::UnixStream::connect(path) {
        Err(error) if error.kind() == io::ErrorKind::ConnectionRefused => fs::remove_file(path).map_err(refused),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
        Err(error) => Err(refused(error)),
        Ok(_) => Err(ServeError::InUse { address: address.clone() }),
    }
}

/// Binds with mode 0600 from the first moment: in a directory only the owner can enter, then linked to its place, which
/// fails if another server took it meanwhile.
fn bind_private(path: &Path) -> io::Result<(UnixListener, SocketFile)> {
    let parent = path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let room =
        tempfile::Builder::new().prefix(".").permissions(fs::Permissions::from_mode(0o700)).tempdir_in(parent)?;
    let inside = room.path().join("s");
    let bound = UnixListener::bind(&inside).and_then(|listener| {
        fs::set_permissions(&inside, fs::Permissions::from_mode(0o600))?;
        let made = fs::symlink_metadata(&inside)?;
        fs::hard_link(&inside, path)?;
        Ok((listener, SocketFile { path: path.to_owned(), device: made.dev(), inode: made.ino() }))
    });
    let _ = fs::remove_file(&inside);
    bound
}
