"""The tipping example in every format, as users and other tools write it."""

import pytest

from fuzzy_arbiter import Arbiter
from fuzzy_arbiter.formats import reads
from tests.fuzzy_arbiter import reference

FIS = """[System]
Name='tipper'
Type='mamdani'
Version=2.0
NumInputs=2
NumOutputs=1
NumRules=3
AndMethod='min'
OrMethod='max'
ImpMethod='min'
AggMethod='max'
DefuzzMethod='centroid'

[Input1]
Name='service'
Range=[0 10]
NumMFs=3
MF1='poor':'trimf',[-4 0 4]
MF2='good':'trimf',[1 5 9]
MF3='excellent':'trimf',[6 10 14]

[Input2]
Name='food'
Range=[0 10]
NumMFs=2
MF1='rancid':'trapmf',[-1 0 1 3]
MF2='delicious':'trapmf',[7 9 10 11]

[Output1]
Name='tip'
Range=[0 30]
NumMFs=3
MF1='cheap':'trimf',[0 5 10]
MF2='average':'trimf',[10 15 20]
MF3='generous':'trimf',[20 25 30]

[Rules]
1 1, 1 (1) : 2
2 0, 2 (1) : 1
3 2, 3 (1) : 2
"""
FCL = """/*
 Tip *calculator* (like jFuzzyLogic's) // nested
*/
function_block tipper	// Block definition (there may be more than one block per file)
VAR_INPUT
	service : REAL; RANGE := (0 .. 10);
	food : real; range := (0..10);
END_VAR
VAR_OUTPUT
	tip : REAL;
END_VAR
FUZZIFY service
	TERM poor := (0, 1) (4, 0) ;
	TERM good := (1, 0) (5,1) (9,0);
	TERM excellent := (6, 0), (10, 1);
END_FUZZIFY
Fuzzify food
	TERM rancid := (0, 1) (1, 1) (3,0) ;
	TERM delicious := (7,0) (9,1);
END_FUZZIFY
DEFUZZIFY tip
	TERM cheap := trian 0 5 10;
	TERM average := TRIAN 10.0 15.0e0 2E1;
	TERM generous := (20,0) (25,1) (30,0);
	METHOD : COG;		// 'Center Of Gravity'
	DEFAULT := NC;
	RANGE := (0.0..30.0);
END_DEFUZZIFY
RULEBLOCK No1
	AND : MIN;
	ACT : MIN;
	ACCU : MAX;
	RULE 1 : IF service IS poor OR food is rancid THEN tip IS cheap;
	RULE 2 : IF service IS good THEN tip IS average; (* the *) (* usual *)
	RULE 3 : if (service IS excellent) OR (food IS delicious) THEN tip is generous with 1.0;
END_RULEBLOCK
END_FUNCTION_BLOCK
"""
FLL = """#Code automatically generated with fuzzylite 6.0.

Engine: tipper
  description: a tip: how much?
InputVariable: service
  enabled: true
  range: 0.000 10.000
  lock-range: false
  term: poor Ramp 4.000 0.000
  term: good Triangle 1.000 5.000 9.000
  term: excellent Triangle 6.000 10.000 inf   # shoulder
InputVariable: food
	enabled: true
	range: 0 10
	term: rancid Trapezoid -inf 0.000 1.000 3.000
	term: delicious   Discrete 7 0 9 1
OutputVariable: tip
  enabled: true
  range: 0.000 30.000
  lock-range: false
  aggregation: Maximum
  defuzzifier: Centroid 101
  default: nan
  lock-previous: false
  term: cheap Triangle 0.000 5.000 10.000
  term: average Triangle 10.000 15.000 20.000
  term: generous Triangle 20.000 25.000 30.000
RuleBlock:
  enabled: true
  conjunction: none
  disjunction: Maximum
  implication: Minimum
  activation: General
  rule: if service is poor or food is rancid then tip is cheap
  rule: if  service  is good then tip is average with 1.000
  rule: if service is excellent or food is delicious then tip is generous
"""
TOML = '''
name = "tipper" # comment
normalization = 'none'
rules = ["""if service is poor or
  food is rancid then tip is cheap""", 'if service is good then tip is average',
  "IF service IS excellent OR food IS delicious THEN tip IS generous",]
[[inputs]]
name = "service"
universe = [0, 1_0]
terms.poor.falling = [0, 4]
terms.good.triangle = [1, 5, 9]
terms.excellent.rising = [6.0, 1e1]
[[inputs]]
name = "food"
universe = [0, 10,]
[inputs.terms]
rancid = {falling = [1, 3]}
delicious = [[7, 0], [9, 1],
]
[[outputs]]
name = "tip"
universe = [+0, 30]
terms = {cheap = {triangle=[0,5,10]}, average = {triangle=[10,15,20]}, generous={triangle=[20,25,30]}}
'''
JSON = """{"name":"tipper","normalization":"none","points":101,
"inputs":[
{"name":"service","universe":[0,10],"terms":{"poor":[[0,1],[4,0]],"good":{"triangle":[1,5,9]},"excellent":{"rising":[6,10]}}},
{"name":"food","universe":[0,10],"terms":{"rancid":{"falling":[1,3]},"delicious":[[7,0],[9,1]]}}],
"outputs":[{"name":"tip","universe":[0,30],"default":null,
"terms":{"cheap":{"triangle":[0,5,10]},"average":{"triangle":[10,15,20]},"generous":{"triangle":[20,25,30]}}}],
"rules":["if service is poor | food is rancid then tip is cheap","if service is good then tip is average",
"if service is excellent or food is delicious then tip is generous"]}"""
TEXTS = {"fis": FIS, "fcl": FCL, "fll": FLL, "toml": TOML, "json": JSON}


@pytest.mark.parametrize("format", TEXTS)
def test_all_formats_read_to_the_same_system(format):
    text = TEXTS[format]
    for form in (text, "\ufeff" + text.replace("\n", "\r\n"), text.replace("\n", "\r"), text.replace("\n", "  \n")):
        assert reads(form, format) == reads(FIS, "fis")


def test_centroids_are_exact():
    system = reads(FIS, "fis")
    for inputs in ([0, 0], [3, 8.0], [5.5, 2.2], [9.9, 9.9]):
        exact = reference.centroids(system, inputs)
        assert Arbiter(system=system)(inputs) == pytest.approx(list(map(float, exact)), rel=1e-15)
