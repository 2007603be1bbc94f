//! Permitted content of an ONNX file, checked before any runtime reads it.
//!
//! The runtime is a large library, and a file may come from a third party. So the bytes are walked once, without
//! allocating, by a table of the parts and operators that a convolutional detector is made of; parts that the table
//! does not name are refused with their place. That excludes reading other files, branches and loops, random draws, and
//! growth in memory far beyond the file. The function of a graph, and its acceptance by a runtime, are left to
//! [`crate::detector`].
//!
//! Field numbers come from `onnx.proto3` in the ONNX repository, IR version 10.

use crate::model::Model;

/// Most fields of a model, parts of parts included. Each costs a runtime some 250 bytes at most.
pub const MAX_FIELDS: usize = 100_000;
/// Longest name, bytes.
const MAX_NAME: usize = 512;
/// Longest name of a dimension, bytes: runtimes read it as an expression, by recursion.
const MAX_DIMENSION: usize = 64;
/// Types of tensors: float, int32, int64, bool.
const ELEMENTS: [u64; 4] = [1, 6, 7, 9];
/// Operators that a detector may use, in order.
const OPERATORS: [&str; 58] = [
    "Abs",
    "Add",
    "AveragePool",
    "BatchNormalization",
    "Cast",
    "Ceil",
    "Clip",
    "Concat",
    "Constant",
    "ConstantOfShape",
    "Conv",
    "ConvTranspose",
    "Div",
    "Elu",
    "Equal",
    "Erf",
    "Exp",
    "Expand",
    "Flatten",
    "Floor",
    "Gather",
    "Gemm",
    "GlobalAveragePool",
    "GlobalMaxPool",
    "HardSigmoid",
    "HardSwish",
    "Identity",
    "LeakyRelu",
    "Less",
    "Log",
    "MatMul",
    "Max",
    "MaxPool",
    "Min",
    "Mul",
    "Neg",
    "PRelu",
    "Pad",
    "Pow",
    "Range",
    "ReduceMax",
    "ReduceMean",
    "ReduceSum",
    "Relu",
    "Reshape",
    "Resize",
    "Shape",
    "Sigmoid",
    "Slice",
    "Softmax",
    "Softplus",
    "Split",
    "Sqrt",
    "Squeeze",
    "Sub",
    "Tanh",
    "Transpose",
    "Unsqueeze",
];

/// Beginning of a zip archive.
const ZIP: &[u8] = b"PK\x03\x04";
/// Message for a model that is not in one file.
const ELSEWHERE: &str = "weights in another file";

/// Reason for which a file is refused.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum OnnxError {
    /// No protobuf, or cut off.
    #[error("no ONNX model: {why} at byte {at}")]
    Malformed {
        /// Offset in bytes.
        at: usize,
        /// Fault at that offset.
        why: &'static str,
    },
    /// Something that no detector needs.
    #[error("the model has {what} at byte {at}; docs/researcher/detector.md lists the permitted parts")]
    Unwanted {
        /// Offset in bytes.
        at: usize,
        /// Name of the part.
        what: String,
    },
    /// More parts than a detector has.
    #[error("the model has more than {MAX_FIELDS} fields")]
    TooMany,
    /// An empty graph.
    #[error("no ONNX model: it has no graph with operators")]
    Empty,
}

/// A pinned model with permitted parts only.
#[derive(Clone, Copy, Debug)]
pub struct Inspected<'a>(Model<'a>);

impl<'a> Inspected<'a> {
    /// Walks the model once.
    ///
    /// # Errors
    /// The first part that is malformed or unwanted.
    pub fn new(model: Model<'a>) -> Result<Self, OnnxError> {
        if model.bytes().starts_with(ZIP) {
            let why = "a zip archive, as PyTorch saves (export it to ONNX),";
            return Err(OnnxError::Malformed { at: 0, why });
        }
        let mut walk = Walk { fields: 0, operators: 0 };
        walk.part(Part::Model, Span { bytes: model.bytes(), at: 0 })?;
        if walk.operators == 0 { Err(OnnxError::Empty) } else { Ok(Inspected(model)) }
    }

    /// Bytes of the model.
    pub fn bytes(&self) -> &'a [u8] {
        self.0.bytes()
    }
}

/// A message of the format. Each holds only later ones, so a walk is as deep as this list at most.
#[derive(Clone, Copy)]
enum Part {
    Model,
    Graph,
    Node,
    Attribute,
    Tensor,
    Value,
    Type,
    TensorType,
    Shape,
    Dimension,
    Entry,
}

/// Treatment of a field.
enum Rule {
    Into(Part),
    /// Numbers, weights and words that are skipped.
    Plain,
    /// A short word without a zero byte.
    Word(usize),
    /// A formula for a dimension.
    Formula,
    Operator,
    Domain,
    Element,
    /// Location of weights: 0 is in this file.
    Location,
    Unwanted(&'static str),
}

fn rule(part: Part, field: u64) -> Rule {
    use Part::{Attribute, Dimension, Entry, Graph, Model, Node, Shape, Tensor, TensorType, Type, Value};
    match (part, field) {
        (Model, 7) => Rule::Into(Graph),
        (Model, 8 | 14) | (Graph | Tensor, 16) | (Node, 9) | (Value, 4) => Rule::Into(Entry),
        (Model, 1..=6) | (Graph, 10) | (Node, 6) | (Value, 3) => Rule::Plain,
        (Graph, 1) => Rule::Into(Node),
        (Graph, 5) => Rule::Into(Tensor),
        (Graph, 11..=13) => Rule::Into(Value),
        (Node, 4) => Rule::Operator,
        (Node, 7) => Rule::Domain,
        (Node, 5) => Rule::Into(Attribute),
        (Graph, 2) | (Node, 1..=3) | (Attribute, 1) | (Tensor, 8) | (Value, 1) => Rule::Word(MAX_NAME),
        (Attribute, 5) => Rule::Into(Tensor),
        (Attribute, 2..=4 | 7..=9 | 13 | 20) => Rule::Plain,
        (Attribute, 6 | 11) => Rule::Unwanted("a graph within an operator"),
        (Tensor, 2) | (TensorType, 1) => Rule::Element,
        (Tensor, 1 | 4 | 5 | 7 | 9 | 12) => Rule::Plain,
        (Tensor, 13) => Rule::Unwanted(ELSEWHERE),
        (Tensor, 14) => Rule::Location,
        (Value, 2) => Rule::Into(Type),
        (Type, 1) => Rule::Into(TensorType),
        (TensorType, 2) => Rule::Into(Shape),
        (Shape, 1) => Rule::Into(Dimension),
        (Dimension, 2) => Rule::Formula,
        (Type, 6) | (Dimension, 1 | 3) | (Entry, _) => Rule::Plain,
        (Model, 20) => Rule::Unwanted("training"),
        (Model, 25) => Rule::Unwanted("functions of its own"),
        (Model | Graph | Node | Attribute | Tensor | Value | Type | TensorType | Shape | Dimension, _) => {
            Rule::Unwanted("a part that is not known")
        }
    }
}

struct Walk {
    fields: usize,
    operators: usize,
}

impl Walk {
    fn part(&mut self, part: Part, mut span: Span<'_>) -> Result<(), OnnxError> {
        while !span.bytes.is_empty() {
            self.fields += 1;
            if self.fields > MAX_FIELDS {
                return Err(OnnxError::TooMany);
            }
            let index = span.at;
            let (number, content) = span.field()?;
            self.field(rule(part, number), index, content)?;
        }
        Ok(())
    }

    fn field(&mut self, rule: Rule, at: usize, content: Content<'_>) -> Result<(), OnnxError> {
        let unwanted = |what: String| Err(OnnxError::Unwanted { at, what });
        match (rule, content) {
            (Rule::Unwanted(what), _) => unwanted(what.to_owned()),
            (Rule::Plain, _) => Ok(()),
            (Rule::Into(part), Content::Bytes(span)) => self.part(part, span),
            (Rule::Formula, Content::Bytes(span)) if span.bytes.len() > MAX_DIMENSION => {
                let length = span.bytes.len();
                unwanted(format!(
                    "a dimension given by a formula of {length} bytes, as a dynamic export has (export it with fixed sizes),"
                ))
            }
            (Rule::Word(most), Content::Bytes(span)) if span.bytes.len() > most => {
                unwanted(format!("a name of {} bytes, at most {most} allowed,", span.bytes.len()))
            }
            (Rule::Word(_) | Rule::Formula, Content::Bytes(span)) if span.bytes.contains(&0) => {
                unwanted("a name with a zero".to_owned())
            }
            (Rule::Word(_) | Rule::Formula, Content::Bytes(_)) => Ok(()),
            (Rule::Operator, Content::Bytes(span)) => {
                self.operators += 1;
                let known = OPERATORS.iter().any(|known| known.as_bytes() == span.bytes);
                if known { Ok(()) } else { unwanted(format!("the operator `{}`", printed(span.bytes))) }
            }
            (Rule::Domain, Content::Bytes(span)) if matches!(span.bytes, b"" | b"ai.onnx") => Ok(()),
            (Rule::Domain, Content::Bytes(span)) => unwanted(format!("an operator of `{}`", printed(span.bytes))),
            (Rule::Element, Content::Number(kind)) if ELEMENTS.contains(&kind) => Ok(()),
            (Rule::Element, Content::Number(kind)) => {
                unwanted(format!("a tensor of type {kind} ({}), not float, int32, int64 or bool,", element(kind)))
            }
            (Rule::Location, Content::Number(0)) => Ok(()),
            (Rule::Location, _) => unwanted(ELSEWHERE.to_owned()),
            (Rule::Into(_) | Rule::Word(_) | Rule::Formula | Rule::Operator | Rule::Domain, Content::Number(_))
            | (Rule::Element, Content::Bytes(_)) => Err(OnnxError::Malformed { at, why: "a field of another type" }),
        }
    }
}

/// The part of a foreign name that fits a line, in letters without effect on a terminal.
fn printed(bytes: &[u8]) -> String {
    bytes.iter().take(40).map(|b| if b.is_ascii_graphic() { *b as char } else { '?' }).collect()
}

fn element(kind: u64) -> &'static str {
    match kind {
        2..=5 | 12 | 13 => "an integer of another width",
        8 => "text",
        10 => "float16",
        11 => "double",
        16 => "bfloat16",
        _ => "none that is known",
    }
}

/// A field's content.
enum Content<'a> {
    Number(u64),
    Bytes(Span<'a>),
}

/// Bytes that are still to be read, and where in the file they begin.
#[derive(Clone, Copy)]
struct Span<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Span<'a> {
    fn field(&mut self) -> Result<(u64, Content<'a>), OnnxError> {
        let at = self.at;
        let key = self.varint()?;
        let content = match key & 7 {
            0 => Content::Number(self.varint()?),
            1 => Content::Number(self.take(8)?.little()),
            5 => Content::Number(self.take(4)?.little()),
            2 => {
                let length = self.varint()?;
                Content::Bytes(self.take(usize::try_from(length).unwrap_or(usize::MAX))?)
            }
            _ => return Err(OnnxError::Malformed { at, why: "a field of no known kind" }),
        };
        Ok((key >> 3, content))
    }

    fn varint(&mut self) -> Result<u64, OnnxError> {
        let at = self.at;
        let mut value = 0;
        for shift in (0..70).step_by(7) {
            let byte = self.take(1)?.bytes[0];
            value |= u64::from(byte & 0x7f).checked_shl(shift).unwrap_or(0);
            if byte < 0x80 {
                return Ok(value);
            }
        }
        Err(OnnxError::Malformed { at, why: "a number without an end" })
    }

    fn take(&mut self, length: usize) -> Result<Span<'a>, OnnxError> {
        let cut = OnnxError::Malformed { at: self.at, why: "the file ends too early" };
        let (head, rest) = self.bytes.split_at_checked(length).ok_or(cut)?;
        let span = Span { bytes: head, at: self.at };
        *self = Span { bytes: rest, at: self.at + length };
        Ok(span)
    }

    fn little(&self) -> u64 {
        self.bytes.iter().rev().fold(0, |value, byte| value << 8 | u64::from(*byte))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use wire::sensor::Camera;

    use crate::model::{Networks, hex_digest};

    fn inspect(bytes: &[u8]) -> Result<(), OnnxError> {
        Inspected::new(Model::pinned(bytes, &hex_digest(bytes)).unwrap()).map(|_| ())
    }

    #[test]
    fn permitted_operators_are_those_of_the_page() {
        let page = include_str!("../../../docs/researcher/detector.md");
        let listed = page.split("Permitted operators").nth(1).and_then(|text| text.split("\n\n").next()).unwrap();
        let listed: Vec<&str> = listed.split('`').skip(3).step_by(2).collect();
        assert_eq!(listed, OPERATORS);
    }

    /// A field with bytes in it.
    fn field(number: u8, content: &[u8]) -> Vec<u8> {
        let mut bytes = vec![number << 3 | 2];
        bytes.push(u8::try_from(content.len()).unwrap());
        bytes.extend(content);
        bytes
    }

    /// A model with one operator.
    fn operator(name: &str) -> Vec<u8> {
        field(7, &field(1, &field(4, name.as_bytes())))
    }

    #[test]
    fn shipped_model_passes_and_truncated_ones_fail() {
        let shipped = Networks::for_camera(&Camera::GROUND).detector().unwrap().bytes();
        assert_eq!(inspect(shipped), Ok(()));
        // Every cut near a part's edge, and some within the weights.
        let cuts = (0..2_000).chain((2_000..shipped.len()).step_by(997)).chain(shipped.len() - 500..shipped.len());
        let whole: Vec<usize> = cuts.filter(|cut| inspect(&shipped[..*cut]).is_ok()).collect();
        // What comes after the graph is not needed: opset and metadata.
        assert!(whole.iter().all(|cut| *cut > shipped.len() - 100), "{whole:?}");
    }

    #[test]
    fn training_files_are_refused_with_the_remedy() {
        let error_text = inspect(b"PK\x03\x04archive/data.pkl").unwrap_err().to_string();
        assert_eq!(error_text, "no ONNX model: a zip archive, as PyTorch saves (export it to ONNX), at byte 0");
        let dimension = field(1, &field(2, &[b'd'; 65]));
        let value = field(2, &field(1, &field(2, &dimension)));
        let error_text = inspect(&[operator("Conv"), field(7, &field(11, &value))].concat()).unwrap_err().to_string();
        assert!(
            error_text.contains("a formula of 65 bytes, as a dynamic export has (export it with fixed sizes)"),
            "{error_text}"
        );
    }

    /// Operators that branch, loop or draw, and operators of other domains.
    #[test]
    fn forbidden_operators_are_refused_by_name() {
        assert_eq!(inspect(&operator("Conv")), Ok(()));
        for name in ["If", "Loop", "Scan", "RandomNormal", "Multinomial", "NonMaxSuppression", "conv", ""] {
            let label = format!("the operator `{name}`");
            assert_eq!(inspect(&operator(name)), Err(OnnxError::Unwanted { at: 4, what: label }), "{name}");
        }
        let foreign = [field(4, b"Conv"), field(7, b"com.microsoft")].concat();
        let refused = inspect(&field(7, &field(1, &foreign))).unwrap_err();
        assert!(refused.to_string().contains("an operator of `com.microsoft`"), "{refused}");
    }

    /// Half floats, too.
    #[test]
    fn foreign_weights_and_nested_graphs_are_refused() {
        let external = field(13, &[field(1, b"location"), field(2, b"/etc/passwd")].concat());
        let tensors = [
            (external, "weights in another file"),
            (vec![14 << 3, 1], "weights in another file"),
            (vec![2 << 3, 10], "a tensor of type 10 (float16)"),
            (vec![2 << 3, 3], "a tensor of type 3"),
            (field(6, b"text"), "a part that is not known"),
        ];
        for (tensor, said) in tensors {
            // As an initializer, and as what a `Constant` holds.
            let constant = field(1, &[field(4, b"Constant"), field(5, &field(5, &tensor))].concat());
            for graph in [[field(5, &tensor), field(1, &field(4, b"Conv"))].concat(), constant] {
                let refused = inspect(&field(7, &graph)).unwrap_err();
                assert!(refused.to_string().contains(said), "{refused}");
            }
        }
        let branch = field(1, &[field(4, b"Conv"), field(5, &field(6, &[]))].concat());
        let refused = inspect(&field(7, &branch)).unwrap_err();
        assert!(refused.to_string().contains("a graph within an operator"), "{refused}");
    }

    #[test]
    fn weights_stated_in_this_file_are_accepted() {
        let graph = [field(5, &[14 << 3, 0]), field(1, &field(4, b"Conv"))].concat();
        assert_eq!(inspect(&field(7, &graph)), Ok(()));
    }

    #[test]
    fn many_small_parts_are_refused_before_growth() {
        let nodes = [1 << 3 | 2, 0].repeat(MAX_FIELDS);
        let length = nodes.len();
        let mut bytes = vec![7 << 3 | 2, length as u8 | 0x80, (length >> 7) as u8 | 0x80, (length >> 14) as u8];
        bytes.extend(nodes);
        assert_eq!(inspect(&bytes), Err(OnnxError::TooMany));
    }

    /// Names that would end a C string or nest an expression.
    #[test]
    fn names_with_terminators_or_nesting_are_refused() {
        let named = |name: &[u8]| field(7, &[field(2, name), field(1, &field(4, b"Conv"))].concat());
        assert_eq!(inspect(&named(b"graph")), Ok(()));
        assert!(matches!(inspect(&named(b"gr\0ph")), Err(OnnxError::Unwanted { .. })));
        let dimension = |name: &[u8]| {
            let shape = field(2, &field(1, &field(2, name)));
            let input = field(11, &field(2, &field(1, &shape)));
            field(7, &[input, field(1, &field(4, b"Conv"))].concat())
        };
        assert_eq!(inspect(&dimension(b"batch")), Ok(()));
        assert!(matches!(inspect(&dimension(&[b'('; 65])), Err(OnnxError::Unwanted { .. })));
    }

    #[test]
    fn nothing_and_noise_are_no_models() {
        assert_eq!(inspect(b""), Err(OnnxError::Empty));
        assert!(inspect(b"not a model").is_err());
        assert!(matches!(inspect(&[0xff; 64]), Err(OnnxError::Malformed { .. })));
    }
}
