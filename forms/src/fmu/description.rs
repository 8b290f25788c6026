//! `modelDescription.xml` of an FMU: its variables, their units and their dependencies.

use std::fmt::Write as _;

/// Units with their base units.
const UNITS: [(&str, &str); 6] = [
    ("rad", "rad=\"1\""),
    ("rad/s", "rad=\"1\" s=\"-1\""),
    ("rad/s2", "rad=\"1\" s=\"-2\""),
    ("rad/s3", "rad=\"1\" s=\"-3\""),
    ("A", "A=\"1\""),
    ("N.m", "kg=\"1\" m=\"2\" s=\"-2\""),
];

/// Kind of a variable.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Kind {
    /// Input of a controller, read at a tick. With its value at the start.
    Sampled(f64),
    /// Input of a plant. With its value at the start.
    Continuous(f64),
    /// Output of a tick.
    Output,
    /// State of a plant, an output. With its value at the start.
    State(f64),
    /// Derivative of the state with this index, from 1.
    Derivative(usize),
    /// Status flags.
    Health,
    /// Boolean input.
    Reset,
    /// Boolean parameter that is true at the start.
    Parameter,
}

/// Variable of an FMU.
pub(super) struct Variable {
    name: String,
    unit: &'static str,
    text: String,
    kind: Kind,
}

impl Variable {
    pub(super) fn new(name: impl Into<String>, unit: &'static str, text: impl Into<String>, kind: Kind) -> Self {
        Self { name: name.into(), unit, text: text.into(), kind }
    }

    fn is_real(&self) -> bool {
        !matches!(self.kind, Kind::Health | Kind::Reset | Kind::Parameter)
    }

    fn is_input(&self) -> bool {
        matches!(self.kind, Kind::Sampled(_) | Kind::Continuous(_) | Kind::Reset)
    }

    fn is_output(&self) -> bool {
        matches!(self.kind, Kind::Output | Kind::State(_) | Kind::Health)
    }

    pub(super) fn is_real_input(&self) -> bool {
        self.is_real() && self.is_input()
    }

    pub(super) fn is_real_output(&self) -> bool {
        self.is_real() && self.is_output()
    }

    /// Returns true for a value that follows from inputs and states at the start.
    fn is_calculated(&self) -> bool {
        matches!(self.kind, Kind::Output | Kind::Health | Kind::Derivative(_))
    }

    fn xml(&self, reference: usize) -> String {
        let [causality, variability, initial] = match self.kind {
            Kind::Sampled(_) | Kind::Reset => ["input", "discrete", ""],
            Kind::Continuous(_) => ["input", "continuous", ""],
            Kind::Output | Kind::Health => ["output", "discrete", " initial=\"calculated\""],
            Kind::State(_) => ["output", "continuous", " initial=\"exact\""],
            Kind::Parameter => ["parameter", "tunable", " initial=\"exact\""],
            Kind::Derivative(_) => ["local", "continuous", " initial=\"calculated\""],
        };
        let unit = if self.unit.is_empty() { String::new() } else { format!(" unit=\"{}\"", self.unit) };
        let value = match self.kind {
            Kind::Sampled(start) | Kind::Continuous(start) | Kind::State(start) => {
                format!("<Real{unit} start=\"{start:?}\"/>")
            }
            Kind::Output => format!("<Real{unit}/>"),
            Kind::Derivative(state) => format!("<Real{unit} derivative=\"{state}\"/>"),
            Kind::Health => "<Integer/>".into(),
            Kind::Reset => "<Boolean start=\"false\"/>".into(),
            Kind::Parameter => "<Boolean start=\"true\"/>".into(),
        };
        format!(
            "    <ScalarVariable name=\"{}\" valueReference=\"{reference}\" description=\"{}\" \
             causality=\"{causality}\" variability=\"{variability}\"{initial}>{value}</ScalarVariable>\n",
            self.name,
            escaped(&self.text),
        )
    }
}

/// Description of an FMU apart from its variables.
pub(super) struct Description<'a> {
    pub(super) identifier: &'a str,
    pub(super) name: &'a str,
    pub(super) text: &'a str,
    pub(super) guid: &'a str,
    pub(super) span_s: f64,
    pub(super) step_s: f64,
}

/// Returns a text as the value of an attribute.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;").replace('\n', " ")
}

impl Description<'_> {
    /// Returns the whole file. Reals, integers and Booleans are numbered in order.
    pub(super) fn xml(&self, variables: &[Variable]) -> String {
        let Self { identifier, guid, span_s, step_s, .. } = *self;
        let mut out = format!(
            "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
             <fmiModelDescription fmiVersion=\"2.0\" modelName=\"{}\" guid=\"{guid}\" description=\"{}\" \
             version=\"{version}\" generationTool=\"host-sim {version}\" variableNamingConvention=\"structured\" \
             numberOfEventIndicators=\"0\">\n",
            escaped(self.name),
            escaped(self.text),
            version = controller_core::VERSION,
        );
        let saves = "canGetAndSetFMUstate=\"true\" canSerializeFMUstate=\"true\"";
        let any_step = " canHandleVariableCommunicationStepSize=\"true\"";
        for (kind, more) in [("ModelExchange", ""), ("CoSimulation", any_step)] {
            let _ = write!(
                out,
                "  <{kind} modelIdentifier=\"{identifier}\"{more} {saves}>\n    <SourceFiles><File \
                 name=\"{identifier}.c\"/></SourceFiles>\n  </{kind}>\n"
            );
        }
        let used = UNITS.iter().filter(|(unit, _)| variables.iter().any(|variable| variable.unit == *unit));
        let line = |(unit, base): &(&str, &str)| format!("    <Unit name=\"{unit}\"><BaseUnit {base}/></Unit>\n");
        let units: String = used.map(line).collect();
        if !units.is_empty() {
            let _ = write!(out, "  <UnitDefinitions>\n{units}  </UnitDefinitions>\n");
        }
        let _ = write!(
            out,
            "  <LogCategories><Category name=\"logStatusError\"/></LogCategories>\n  <DefaultExperiment \
             startTime=\"0\" stopTime=\"{span_s:?}\" stepSize=\"{step_s:?}\"/>\n  <ModelVariables>\n"
        );
        let mut reals = 0..;
        for variable in variables {
            let reference = match variable.kind {
                Kind::Health | Kind::Reset => 0,
                Kind::Parameter => 1,
                _ => reals.next().unwrap_or(0),
            };
            out += &variable.xml(reference);
        }
        out + "  </ModelVariables>\n" + &structure(variables) + "</fmiModelDescription>\n"
    }
}

/// Returns the outputs, derivatives and calculated values with their dependencies, by their indices from 1.
fn structure(variables: &[Variable]) -> String {
    let numbered = || (1..).zip(variables);
    let inputs: Vec<String> =
        numbered().filter(|(_, variable)| variable.is_input()).map(|(i, _)| i.to_string()).collect();
    let inputs = inputs.join(" ");
    let listed = |name: &str, of: &dyn Fn(&Variable) -> bool| {
        let unknown = |(i, variable): (usize, &Variable)| match variable.kind {
            Kind::State(_) => format!("      <Unknown index=\"{i}\" dependencies=\"{i}\"/>\n"),
            Kind::Derivative(_) => format!("      <Unknown index=\"{i}\"/>\n"),
            _ => format!("      <Unknown index=\"{i}\" dependencies=\"{inputs}\"/>\n"),
        };
        let all: String = numbered().filter(|(_, variable)| of(variable)).map(unknown).collect();
        if all.is_empty() { all } else { format!("    <{name}>\n{all}    </{name}>\n") }
    };
    let is_derivative = |variable: &Variable| matches!(variable.kind, Kind::Derivative(_));
    [
        "  <ModelStructure>\n".into(),
        listed("Outputs", &Variable::is_output),
        listed("Derivatives", &is_derivative),
        listed("InitialUnknowns", &Variable::is_calculated),
        "  </ModelStructure>\n".into(),
    ]
    .concat()
}
