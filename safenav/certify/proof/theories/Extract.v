From Coq Require Import List NArith FMapPositive Extraction ExtrOcamlBasic.
From Proved Require Import Gr1 Strategy Alive Counterstrategy Parse World Team Views Files.
Extraction Language OCaml.
Set Extraction AccessOpaque.
Extraction "extracted/proved.ml"
  establish is_alive refute moves apart answering controller_of
  (* for evidence, and to say what is wrong *)
  parse sat aims begins arrivals check_node check_cnode keeps_node places_of reached_by
  check_starts check_controller check_views
  PositiveMap.add PositiveMap.empty N.of_nat.
