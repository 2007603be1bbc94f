//! The wire between hosts that are apart: a bridge in the router's network, and a pair of interfaces to each other host.
//!
//! Its addresses are `127.254.0.0/24`. No packet with such an address leaves a machine: a process outside the network of its host cannot
//! reach another host by them. Between the interfaces of the wire the kernel routes them, as `route_localnet` allows.

use std::fs::{self, File};
use std::future::Future;
use std::io;
use std::net::{IpAddr, Ipv4Addr};
use std::os::fd::AsFd;

use rtnetlink::{Handle, LinkBridge, LinkMessageBuilder, LinkUnspec, LinkVeth, new_connection};
use rustix::thread::{LinkNameSpaceType, move_into_link_name_space};
use serde::{Deserialize, Serialize};

use crate::error::StepError;

/// Bits of the wire's network.
const PREFIX: u8 = 24;
/// Name of a host's interface.
const OWN: &str = "wire";
/// Name of the router's bridge.
const BRIDGE: &str = "bridge";
/// The loopback interface is the first of every network.
const LOOPBACK: u32 = 1;

/// A host on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Station {
    /// Process that holds its namespaces.
    pub process: u32,
    /// Number in the wire's network.
    pub number: u8,
}

/// The address of the host of this number, from 1.
pub fn address(number: u8) -> Ipv4Addr {
    Ipv4Addr::new(127, 254, 0, number)
}

/// True for an address of a host on a wire.
pub fn is_on_wire(address: IpAddr) -> bool {
    matches!(address, IpAddr::V4(v4) if v4.octets()[..3] == [127, 254, 0])
}

/// Sets the loopback interface of this process's network up.
pub(crate) fn loopback() -> Result<(), StepError> {
    netlink(async |handle| {
        handle.address().add(LOOPBACK, Ipv4Addr::LOCALHOST.into(), 32).execute().await?;
        handle.link().set(LinkUnspec::new_with_index(LOOPBACK).up().build()).execute().await
    })
}

/// Disables IPv6 in this process's network, in which interfaces would send messages unasked. A kernel without IPv6 has
/// no such file.
pub(crate) fn without_ipv6() {
    for of in ["all", "default"] {
        if let Err(error) = fs::write(format!("/proc/sys/net/ipv6/conf/{of}/disable_ipv6"), "1")
            && error.kind() != io::ErrorKind::NotFound
        {
            return;
        }
    }
}

/// Connects the stations to a bridge in this process's network, which takes the address of `number`.
pub(crate) fn connect(number: u8, stations: &[Station]) -> Result<(), StepError> {
    let own_file = File::open("/proc/self/ns/net").map_err(StepError::of_step("own network"))?;
    netlink(async |handle| {
        handle.link().add(LinkBridge::new(BRIDGE).build()).execute().await?;
        bring_up(&handle, BRIDGE, number).await?;
        let bridge = index(&handle, BRIDGE).await?;
        for station in stations {
            let (port, peer) = (format!("host-{}", station.number), format!("{OWN}-{}", station.number));
            handle.link().add(LinkVeth::new(&port, &peer).build()).execute().await?;
            let builder: LinkMessageBuilder<LinkUnspec> =
                LinkUnspec::new_with_name(&peer).setns_by_pid(station.process);
            handle.link().set(builder.build()).execute().await?;
            let port = LinkUnspec::new_with_index(index(&handle, &port).await?).controller(bridge).up();
            handle.link().set(port.build()).execute().await?;
        }
        Ok(())
    })?;
    route_local(BRIDGE)?;
    for station in stations {
        enter(&File::open(format!("/proc/{}/ns/net", station.process))?)?;
        netlink(async |handle| {
            let peer = index(&handle, &format!("{OWN}-{}", station.number)).await?;
            // Named only here: in the router's network all peers would have the same name.
            handle.link().set(LinkUnspec::new_with_index(peer).name(OWN).build()).execute().await?;
            bring_up(&handle, OWN, station.number).await
        })?;
        route_local(OWN)?;
    }
    enter(&own_file)
}

fn enter(network: &File) -> Result<(), StepError> {
    move_into_link_name_space(network.as_fd(), Some(LinkNameSpaceType::Network)).map_err(StepError::of_step("network"))
}

async fn bring_up(handle: &Handle, name: &str, number: u8) -> Result<(), rtnetlink::Error> {
    let index = index(handle, name).await?;
    handle.address().add(index, address(number).into(), PREFIX).execute().await?;
    handle.link().set(LinkUnspec::new_with_index(index).up().build()).execute().await
}

async fn index(handle: &Handle, name: &str) -> Result<u32, rtnetlink::Error> {
    use futures_util::TryStreamExt;
    let mut links = handle.link().get().match_name(name.to_owned()).execute();
    links.try_next().await?.map(|link| link.header.index).ok_or(rtnetlink::Error::RequestFailed)
}

/// Has the kernel take addresses of `127.0.0.0/8` on an interface of this process's network.
fn route_local(interface: &str) -> Result<(), StepError> {
    let set = |name: &str| fs::write(format!("/proc/sys/net/ipv4/conf/{name}/route_localnet"), "1");
    set("all")
        .and_then(|()| set(interface))
        .map_err(|error| StepError::RouteLocal { interface: interface.to_owned(), error })
}

/// Sends requests to the kernel over a netlink socket of the network that this process is in now.
fn netlink<F>(requests: impl FnOnce(Handle) -> F) -> Result<(), StepError>
where
    F: Future<Output = Result<(), rtnetlink::Error>>,
{
    let step = StepError::of_step::<io::Error>;
    let runtime = tokio::runtime::Builder::new_current_thread().enable_io().build().map_err(step("netlink"))?;
    runtime.block_on(async {
        let (connection, handle, _) = new_connection().map_err(step("netlink"))?;
        tokio::spawn(connection);
        requests(handle).await.map_err(StepError::Network)
    })
}
