From Coq Require Import List NArith FMapPositive Extraction ExtrOcamlBasic.
From Proved Require Import Gr1 Strategy Counterstrategy Parse Certificates.
Extraction Language OCaml.
Set Extraction AccessOpaque.
Extraction "extracted/proved.ml"
  establish refute
  (* for evidence, and to say what is wrong *)
  parse begins check_node check_cnode
  PositiveMap.add PositiveMap.empty N.of_nat.
