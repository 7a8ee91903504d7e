(** The definitions are not vacuous: a light that must be on infinitely often if somebody is present
    infinitely often, and never while nobody is. *)
From Coq Require Import Ascii String List NArith PArith FMapPositive.
From Proved Require Import Gr1 Ranks Strategy Counterstrategy Parse Print Certificates.
Import ListNotations.

Definition nl : string := String (ascii_of_nat 10) EmptyString.
Fixpoint unlines (l : list string) : string :=
  match l with [] => EmptyString | s :: l => (s ++ nl ++ unlines l)%string end.

Definition lamp : text := Eval compute in codes (unlines
  ["[INPUT]"; "somebody"; "[OUTPUT]"; "light:0...2";
   "[ENV_INIT]"; "!somebody"; "[SYS_INIT]"; "light = 0";
   "[SYS_TRANS]"; "!somebody' -> light' = 0"; "light' <= light + 1";
   "[ENV_LIVENESS]"; "somebody & somebody'"; "[SYS_LIVENESS]"; "light' = 2"]%string).

(** Node: somebody, light. *)
Definition n (s l : N) (ps : list positive) (m : N) (a : option nat) : node :=
  {| row := [s; l]; next := ps; rank_of := [(m, a)] |}.

Definition good : graph := Eval compute in fold_right (fun pu g => PositiveMap.add (fst pu) (snd pu) g)
  (PositiveMap.empty node)
  [(1%positive, n 0 0 [1; 2]%positive 0 (Some O));
   (2%positive, n 1 1 [1; 3]%positive 0 (Some O));
   (3%positive, n 1 2 [1; 3]%positive 0 (Some O))].

Example lamp_works : establish lamp good = true.
Proof. vm_compute. reflexivity. Qed.

Corollary lamp_realizable : exists sp names, parse lamp = Some (sp, names) /\ realizable sp.
Proof.
  destruct (establish_sound lamp good lamp_works) as (sp & names & P & R).
  exists sp, names. split; auto. exists (strategy_of sp good); auto.
Qed.

(** A specification that was read is printed and read back unchanged. *)
Example lamp_printed : match parse lamp with
  | Some (sp, ns) =>
      parse (print sp [(codes "somebody", true, (0, 1)%N); (codes "light", false, (0, 2)%N)])
      = Some (sp, ns)
  | None => False
  end.
Proof. vm_compute. reflexivity. Qed.

(** Refused: without the excuse, with a successor missing, with a rank that rises. *)
Definition but (p : positive) (u : node) : graph := PositiveMap.add p u good.
Example no_excuse : establish lamp (but 1 (n 0 0 [1; 2]%positive 0 None)) = false.
Proof. vm_compute. reflexivity. Qed.
Example no_answer : establish lamp (but 2 (n 1 1 [1]%positive 0 (Some O))) = false.
Proof. vm_compute. reflexivity. Qed.
Example rises : establish lamp (but 1 (n 0 0 [1; 2]%positive 1 (Some O))) = false.
Proof. vm_compute. reflexivity. Qed.

(** If the light must be on immediately, there is no strategy: nobody ever comes. *)
Definition dark : text := Eval compute in codes (unlines
  ["[INPUT]"; "somebody"; "[OUTPUT]"; "light";
   "[SYS_TRANS]"; "!somebody' -> !light'"; "[SYS_LIVENESS]"; "light'"]%string).

Definition c (l : N) : cnode :=
  {| base := {| row := [0; l]%N; next := [1%positive]; rank_of := [(0%N, Some O)] |}; chosen := [0%N] |}.
Definition away : cgraph := PositiveMap.add 2%positive (c 1) (PositiveMap.add 1%positive (c 0) (PositiveMap.empty cnode)).

Example nobody_comes : refute dark away [0%N] = true.
Proof. vm_compute. reflexivity. Qed.

Corollary dark_unrealizable : exists sp names, parse dark = Some (sp, names) /\ ~ realizable sp.
Proof. exact (refute_sound dark away [0%N] nobody_comes). Qed.
