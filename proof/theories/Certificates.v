(** The theorems about certificates: the bytes of a specification with the graph of a strategy, or of
    a counterstrategy. Each function that the program calls is here, with the consequence of its
    result [true]. *)
From Coq Require Import List NArith.
From Proved Require Import Gr1 Strategy Counterstrategy Parse.
Import ListNotations.

(** The strategy realizes the text. *)
Definition establish (s : text) (g : graph) : bool :=
  match parse s with Some (sp, _) => check sp g | None => false end.

Theorem establish_sound s g : establish s g = true ->
  exists sp ns, parse s = Some (sp, ns) /\ realizes sp (strategy_of sp g).
Proof.
  unfold establish. destruct (parse s) as [(sp, ns) |]; [| discriminate].
  intros C. exists sp, ns. split; auto. apply check_realizes; auto.
Qed.

(** No strategy realizes the text. *)
Definition refute (s : text) (g : cgraph) (start : list N) : bool :=
  match parse s with Some (sp, _) => check_counter sp g start | None => false end.

Theorem refute_sound s g start : refute s g start = true ->
  exists sp ns, parse s = Some (sp, ns) /\ ~ realizable sp.
Proof.
  unfold refute. destruct (parse s) as [(sp, ns) |]; [| discriminate].
  intros C. exists sp, ns. split; auto. eapply check_counter_sound; eauto.
Qed.
