//! The server for Foxglove's app, with a client that speaks the WebSocket protocol of its SDK.

use std::time::Duration;

use futures_util::{SinkExt, StreamExt};
use link::foxglove::{Kind, Offered};
use serde_json::{Value, json};
use tokio_tungstenite::connect_async;
use tokio_tungstenite::tungstenite::Message;
use tokio_tungstenite::tungstenite::client::IntoClientRequest;

const KIND: Kind<'static> = Kind {
    topic: "/display",
    encoding: "json",
    schema: ["holdsafe.Picture", "jsonschema"],
    definition: b"{\"type\":\"object\"}",
};
const PICTURE: &[u8] = b"{\"version\":1}";

/// The server advertises the channels, and sends their messages until the end.
#[test]
fn app_gets_the_channels_it_subscribes_to() {
    let mut offered = Offered::open(0).unwrap();
    let address = offered.address();
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    let mut stream = runtime.block_on(async {
        let mut request = address.as_str().into_client_request().unwrap();
        request.headers_mut().insert("sec-websocket-protocol", "foxglove.sdk.v1".parse().unwrap());
        let (mut stream, answer) = connect_async(request).await.unwrap();
        assert_eq!(answer.headers()["sec-websocket-protocol"], "foxglove.sdk.v1");
        // A channel exists after its first message, which is repeated until it is received.
        let mut repeat = tokio::time::interval(Duration::from_millis(5));
        loop {
            let message = tokio::select! {
                message = stream.next() => message.expect("a message").unwrap(),
                _ = repeat.tick() => {
                    offered.send(KIND, PICTURE).unwrap();
                    continue;
                }
            };
            match message {
                Message::Text(text) => {
                    let announcement: Value = serde_json::from_str(&text).unwrap();
                    if announcement["op"] == "serverInfo" {
                        assert_eq!(
                            (&announcement["name"], &announcement["capabilities"]),
                            (&json!("holdsafe"), &json!([]))
                        );
                    } else if announcement["op"] == "advertise" {
                        let channel = &announcement["channels"][0];
                        assert_eq!(
                            (&channel["topic"], &channel["schemaName"]),
                            (&json!("/display"), &json!(KIND.schema[0]))
                        );
                        let subscription = json!({ "id": 5, "channelId": channel["id"] });
                        let wish = json!({ "op": "subscribe", "subscriptions": [subscription] });
                        stream.send(Message::text(wish.to_string())).await.unwrap();
                    }
                }
                // Kind, subscription and time come first; then the message.
                Message::Binary(bytes) => {
                    assert_eq!((bytes[0], &bytes[1..5], &bytes[13..]), (1, &5_u32.to_le_bytes()[..], PICTURE));
                    return stream;
                }
                other @ (Message::Ping(_) | Message::Pong(_) | Message::Close(_) | Message::Frame(_)) => {
                    panic!("{other:?}")
                }
            }
        }
    });
    drop(offered);
    // Messages sent before may still arrive; then the stream ends.
    runtime.block_on(async { while let Some(Ok(_)) = stream.next().await {} });
    assert!(runtime.block_on(connect_async(address.as_str().into_client_request().unwrap())).is_err());
}

#[test]
fn a_port_that_is_taken_is_an_error() {
    let offered = Offered::open(0).unwrap();
    let port = offered.address().rsplit_once(':').unwrap().1.parse().unwrap();
    assert!(Offered::open(port).is_err());
}
