//! What other programs do to a window: a file manager drops files on it by the XDND protocol (version 5,
//! freedesktop.org), other windows cover it.

use std::path::Path;

use x11rb::connection::Connection as _;
use x11rb::protocol::Event;
use x11rb::protocol::xproto::{
    ClientMessageEvent, ConnectionExt as _, CreateWindowAux, EventMask, PropMode, SelectionNotifyEvent,
    WindowClass,
};
use x11rb::rust_connection::RustConnection;
use x11rb::wrapper::ConnectionExt as _;

/// Version of the protocol.
const VERSION: u32 = 5;

/// A window over all others as long as it lives.
pub struct Cover {
    _connection: RustConnection,
}

/// Covers the whole screen.
pub fn cover(display: &str) -> Cover {
    let (x, screen) = RustConnection::connect(Some(display)).expect("an X server");
    let screen = &x.setup().roots[screen];
    let (root, size) = (screen.root, [screen.width_in_pixels, screen.height_in_pixels]);
    let own = x.generate_id().unwrap();
    let aux = CreateWindowAux::new().override_redirect(1).background_pixel(0);
    x.create_window(0, own, root, 0, 0, size[0], size[1], 0, WindowClass::INPUT_OUTPUT, 0, &aux).unwrap();
    x.map_window(own).unwrap();
    x.flush().unwrap();
    Cover { _connection: x }
}

/// Drops a file in the middle of a window; comes back when the window has taken it.
pub fn drop_file(display: &str, window: u32, file: &Path) {
    let (x, screen) = RustConnection::connect(Some(display)).expect("an X server");
    let root = x.setup().roots[screen].root;
    let atom = |name: &str| x.intern_atom(false, name.as_bytes()).unwrap().reply().unwrap().atom;
    let own = x.generate_id().unwrap();
    let aux = CreateWindowAux::new();
    x.create_window(0, own, root, 0, 0, 1, 1, 0, WindowClass::INPUT_OUTPUT, 0, &aux).unwrap();
    let (selection, uri_list) = (atom("XdndSelection"), atom("text/uri-list"));
    x.set_selection_owner(own, selection, x11rb::CURRENT_TIME).unwrap();
    let send = |kind: &str, data: [u32; 5]| {
        let message = ClientMessageEvent::new(32, window, atom(kind), data);
        x.send_event(false, window, EventMask::NO_EVENT, message).unwrap();
        x.flush().unwrap();
    };
    let action = atom("XdndActionCopy");
    send("XdndEnter", [own, VERSION << 24, uri_list, 0, 0]);
    send("XdndPosition", [own, 0, 100 << 16 | 100, x11rb::CURRENT_TIME, action]);
    let (status, finished) = (atom("XdndStatus"), atom("XdndFinished"));
    let (mut given, mut accepted, mut dropped) = (false, false, false);
    let deadline = std::time::Instant::now() + std::time::Duration::from_secs(20);
    loop {
        assert!(std::time::Instant::now() < deadline, "the window did not take the file");
        let Some(event) = x.poll_for_event().expect("an X server") else {
            std::thread::sleep(std::time::Duration::from_millis(5));
            continue;
        };
        match event {
            Event::SelectionRequest(wanted) => {
                let text = format!("file://{}\r\n", file.display());
                let (to, property) = (wanted.requestor, wanted.property);
                x.change_property8(PropMode::REPLACE, to, property, uri_list, text.as_bytes()).unwrap();
                let notify = SelectionNotifyEvent {
                    response_type: x11rb::protocol::xproto::SELECTION_NOTIFY_EVENT,
                    sequence: 0,
                    time: wanted.time,
                    requestor: to,
                    selection: wanted.selection,
                    target: wanted.target,
                    property,
                };
                x.send_event(false, to, EventMask::NO_EVENT, notify).unwrap();
                x.flush().unwrap();
                given = true;
            }
            Event::ClientMessage(message) if message.type_ == status => accepted = true,
            Event::ClientMessage(message) if message.type_ == finished => break,
            _ => {}
        }
        if given && accepted && !dropped {
            // The window reads what it was given before it hears of the drop.
            std::thread::sleep(std::time::Duration::from_millis(200));
            send("XdndDrop", [own, 0, x11rb::CURRENT_TIME, 0, 0]);
            dropped = true;
        }
    }
}
