//! The detector's network and its loss.
//!
//! Seven convolutions with batch normalisation, stride 8 in all; a plain head. The network gives raw numbers, and
//! `perception::detector` turns them into probabilities and boxes, so that no activation differs between runtimes.

use burn::module::Module;
use burn::nn::conv::{Conv2d, Conv2dConfig};
use burn::nn::{BatchNorm, BatchNormConfig, PaddingConfig2d};
use burn::tensor::activation::{log_softmax, relu, sigmoid};
use burn::tensor::{Device, Tensor};

/// Channels that the head gives.
pub(crate) const CHANNELS: usize = 9;

/// A convolution, normalised and rectified.
#[derive(Module, Debug)]
pub(crate) struct Block {
    conv: Conv2d,
    norm: BatchNorm,
}

impl Block {
    fn new(channels: [usize; 2], stride: usize, dilation: usize, device: &Device) -> Self {
        let conv = Conv2dConfig::new(channels, [3, 3])
            .with_stride([stride, stride])
            .with_dilation([dilation, dilation])
            .with_padding(PaddingConfig2d::Explicit(dilation, dilation, dilation, dilation))
            .with_bias(false);
        Block { conv: conv.init(device), norm: BatchNormConfig::new(channels[1]).init(device) }
    }

    fn forward(&self, x: Tensor<4>) -> Tensor<4> {
        relu(self.norm.forward(self.conv.forward(x)))
    }
}

/// The network: `[n, 3, 120, 160]` in 0..1 to `[n, 9, 15, 20]`.
#[derive(Module, Debug)]
pub(crate) struct Net {
    blocks: Vec<Block>,
    head: Conv2d,
}

impl Net {
    /// With weights drawn from the device's seed.
    pub(crate) fn new(device: &Device) -> Self {
        let plan =
            [([3, 12], 2, 1), ([12, 24], 1, 1), ([24, 32], 2, 1), ([32, 48], 2, 1), ([48, 64], 1, 1), ([64, 64], 1, 2)];
        Net {
            blocks: plan
                .into_iter()
                .map(|(channels, stride, dilation)| Block::new(channels, stride, dilation, device))
                .collect(),
            head: Conv2dConfig::new([64, CHANNELS], [1, 1]).init(device),
        }
    }

    /// Raw numbers for each cell.
    pub(crate) fn forward(&self, x: Tensor<4>) -> Tensor<4> {
        self.head.forward(self.blocks.iter().fold(x, |x, block| block.forward(x)))
    }
}

/// What a batch should give; each `[n, channels, cells]`.
pub(crate) struct Wanted {
    /// One channel.
    pub(crate) object: Tensor<3>,
    /// One channel.
    pub(crate) asked: Tensor<3>,
    /// Four channels.
    pub(crate) class: Tensor<3>,
    /// Four channels.
    pub(crate) place: Tensor<3>,
}

/// Focal objectness, cross entropy of the class and a smooth distance of the box, the last two where an object is.
pub(crate) fn loss(given: Tensor<4>, wanted: Wanted) -> Tensor<1> {
    let [n, channels, rows, columns] = given.dims();
    let given = given.reshape([n, channels, rows * columns]);
    let objects = wanted.object.clone().sum().clamp_min(1.0);
    let x = given.clone().narrow(1, 0, 1);
    let miss = sigmoid(x.clone()).detach() - wanted.object.clone();
    let weight = miss.clone() * miss * wanted.asked * (wanted.object.clone() + 1.0);
    let entropy = relu(x.clone()) - x.clone() * wanted.object.clone() + (x.abs().neg().exp() + 1.0).log();
    let objectness = (entropy * weight).sum() / objects.clone();
    let class = log_softmax(given.clone().narrow(1, 1, 4), 1) * wanted.class;
    let class = class.sum().neg() / objects.clone();
    let apart = given.narrow(1, 5, 4) - wanted.place;
    let apart = ((apart.clone() * apart + 0.01).sqrt() - 0.1) * wanted.object;
    objectness * 2.0 + class + apart.sum() / objects
}
