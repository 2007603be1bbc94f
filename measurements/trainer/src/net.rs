//! The detector's network and its loss.
//!
//! Six convolutions with batch normalisation, stride 4 in all and then dilated, so that a small object keeps its place and
//! a large one is seen whole; a plain head. The network gives raw numbers, and
//! `perception::detector` turns them into probabilities and boxes, so that no activation differs between runtimes.

use burn::module::Module;
use burn::nn::conv::{Conv2d, Conv2dConfig};
use burn::nn::{BatchNorm, BatchNormConfig, PaddingConfig2d};
use burn::tensor::activation::{log_softmax, relu, sigmoid};
use burn::tensor::{Device, Tensor, TensorData};

use crate::sense::Sense;

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

/// The network: `[n, planes, 120, 160]` in 0..1 to `[n, 9, 30, 40]`.
#[derive(Module, Debug)]
pub(crate) struct Net {
    blocks: Vec<Block>,
    head: Conv2d,
}

impl Net {
    /// With weights drawn from the device's seed.
    pub(crate) fn new(sense: Sense, device: &Device) -> Self {
        // Stride, dilation.
        let plan = [(2, 1), (1, 1), (2, 1), (1, 1), (1, 2), (1, 4)];
        let (mut blocks, mut into) = (Vec::with_capacity(plan.len()), sense.inputs());
        for ((stride, dilation), out) in plan.into_iter().zip(sense.channels()) {
            blocks.push(Block::new([into, out], stride, dilation, device));
            into = out;
        }
        Net { blocks, head: Conv2dConfig::new([into, CHANNELS], [1, 1]).init(device) }
    }

    /// The network with objectness `slope · x + offset`: the calibration, folded into the head.
    pub(crate) fn calibrated(self, slope: f32, offset: f32, device: &Device) -> Self {
        let row = |first: f32, rest: f32| {
            let mut values = vec![rest; CHANNELS];
            values[0] = first;
            Tensor::<1>::from_data(TensorData::new(values, [CHANNELS]), device)
        };
        let Net { blocks, mut head } = self;
        head.weight = head.weight.map(|w| w * row(slope, 1.0).reshape([CHANNELS, 1, 1, 1]));
        head.bias = head.bias.map(|bias| bias.map(|b| b * row(slope, 1.0) + row(offset, 0.0)));
        Net { blocks, head }
    }

    /// Raw numbers for each cell.
    pub(crate) fn forward(&self, x: Tensor<4>) -> Tensor<4> {
        self.head.forward(self.blocks.iter().fold(x, |x, block| block.forward(x)))
    }
}

/// Wanted output for a batch; each `[n, channels, cells]`.
pub(crate) struct Wanted {
    /// One channel.
    pub(crate) object: Tensor<3>,
    /// One channel.
    pub(crate) asked: Tensor<3>,
    /// One channel.
    pub(crate) weight: Tensor<3>,
    /// Four channels.
    pub(crate) class: Tensor<3>,
    /// Four channels.
    pub(crate) place: Tensor<3>,
}

/// Focal objectness, cross entropy of the class and a smooth distance of the box, the last two where an object
/// is, by the weight of its cells.
pub(crate) fn loss(tensor: Tensor<4>, wanted: Wanted) -> Tensor<1> {
    let [n, channels, rows, columns] = tensor.dims();
    let tensor = tensor.reshape([n, channels, rows * columns]);
    let objects = wanted.object.clone().sum().clamp_min(1.0);
    let x = tensor.clone().narrow(1, 0, 1);
    let miss = sigmoid(x.clone()).detach() - wanted.object.clone();
    let weight = miss.clone() * miss * wanted.asked * (wanted.object.clone() + 1.0);
    let entropy = relu(x.clone()) - x.clone() * wanted.object.clone() + (x.abs().neg().exp() + 1.0).log();
    let objectness = (entropy * weight).sum() / objects.clone();
    let total = wanted.weight.clone().sum().clamp_min(1.0);
    let class = log_softmax(tensor.clone().narrow(1, 1, 4), 1) * wanted.class * wanted.weight.clone();
    let class = class.sum().neg() / total.clone();
    let apart = tensor.narrow(1, 5, 4) - wanted.place;
    let apart = ((apart.clone() * apart + 0.01).sqrt() - 0.1) * wanted.weight;
    objectness * 2.0 + class + apart.sum() / total
}
