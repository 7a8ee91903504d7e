(** A strategy as a graph with ranks, and a check that it realizes a specification. *)
From Coq Require Import List NArith PArith Arith Bool Lia FMapPositive.
From Proved Require Import Gr1 Simplify Ranks.
Import ListNotations.

(** A node has a value of each variable, the nodes that may follow it, and a rank for each goal. *)
Record node := { row : list N; next : list positive; rank_of : list rank }.
Definition graph := PositiveMap.t node.

Definition state_of (u : node) : state := get (row u).

(** The nodes of a graph with these names; None if some name is unknown. *)
Fixpoint look {A} (g : PositiveMap.t A) (ps : list positive) : option (list A) :=
  match ps with
  | [] => Some []
  | p :: ps => match PositiveMap.find p g, look g ps with
               | Some u, Some us => Some (u :: us)
               | _, _ => None
               end
  end.

Definition all_of {A} (g : PositiveMap.t A) : list A := map snd (PositiveMap.elements g).

Lemma look_in {A} (g : PositiveMap.t A) ps : forall vs v, look g ps = Some vs -> In v vs ->
  In v (all_of g).
Proof.
  induction ps as [| p ps IH]; intros vs v L I; cbn in L.
  - injection L as <-. destruct I.
  - destruct (PositiveMap.find p g) as [u |] eqn:E; [| discriminate].
    destruct (look g ps) as [us |]; [| discriminate]. injection L as <-.
    destruct I as [<- | I]; [| exact (IH us v eq_refl I)].
    apply PositiveMap.elements_correct in E.
    unfold all_of. change u with (snd (p, u)). apply in_map; auto.
Qed.

Definition begins (sp : spec) (u : node) : bool :=
  if sats (state_of u) (state_of u) (env_init sp)
  then sats (state_of u) (state_of u) (sys_init sp) else false.

Definition beginning (sp : spec) (g : graph) : list node := filter (begins sp) (all_of g).

Fixpoint in_ranges (rs : list (N * N)) (ns : list N) : bool :=
  match rs, ns with
  | [], [] => true
  | (lo, hi) :: rs, n :: ns =>
      if N.leb lo n then if N.leb n hi then in_ranges rs ns else false else false
  | _, _ => false
  end.

Fixpoint same_inputs (n : nat) (a b : list N) : bool :=
  match n, a, b with
  | O, _, _ => true
  | S n, x :: a, y :: b => if N.eqb x y then same_inputs n a b else false
  | _, _, _ => false
  end.

(** No two of these have the same inputs. *)
Fixpoint distinct (n : nat) (rows : list (list N)) : bool :=
  match rows with
  | [] => true
  | r :: rows => if existsb (same_inputs n r) rows then false else distinct n rows
  end.

Fixpoint progresses (excuses goals : list form) (s s' : state) (ms ms' : list rank) : bool :=
  match goals, ms, ms' with
  | [], _, _ => true
  | g :: goals, m :: ms, m' :: ms' =>
      if progress excuses g s s' m m' then progresses excuses goals s s' ms ms' else false
  | _, _, _ => false
  end.

Lemma progresses_nth ex goals : forall s s' ms ms' j goal,
  progresses ex goals s s' ms ms' = true -> nth_error goals j = Some goal ->
  progress ex goal s s' (nth j ms (0%N, None)) (nth j ms' (0%N, None)) = true.
Proof.
  induction goals as [| g' goals IH]; intros s s' ms ms' j goal P J; [destruct j; discriminate |].
  destruct ms as [| m ms], ms' as [| m' ms']; cbn in P; try discriminate.
  destruct (progress ex g' s s' m m') eqn:Q; [| discriminate].
  destruct j as [| j]; cbn in *; [injection J as <-; auto | eapply IH; eauto].
Qed.

(** What is known in a node before the next step. *)
Definition now_is (r : list N) : known :=
  fun x => match x with Now x => Some (get r x) | Next _ => None end.

(** A rank names existing excuses only. *)
Definition rank_ok (n : nat) (m : rank) : bool :=
  match snd m with Some a => Nat.ltb a n | None => true end.

Definition check_edge (sp : spec) (fs : list form) (u v : node) : bool :=
  if sats (state_of u) (state_of v) fs
  then progresses (env_live sp) (sys_live sp) (state_of u) (state_of v) (rank_of u) (rank_of v)
  else false.

Definition check_node (sp : spec) (g : graph) (u : node) : bool :=
  match look g (next u) with
  | None => false
  | Some vs =>
      let rows := map row vs in
      let env := simps (now_is (row u)) (env_trans sp) in
      let sys := simps (now_is (row u)) (sys_trans sp) in
      in_ranges (ranges sp) (row u)
      && distinct (inputs sp) rows
      && forallb (check_edge sp (env ++ sys) u) vs
      && cover true (input_values sp) env rows
      && Nat.eqb (length (rank_of u)) (length (sys_live sp))
      && forallb (rank_ok (length (env_live sp))) (rank_of u)
  end.

Definition nothing : known := fun _ => None.

Definition check (sp : spec) (g : graph) : bool :=
  Nat.leb (inputs sp) (length (ranges sp))
  && forallb (check_node sp g) (all_of g)
  && cover false (input_values sp) (simps nothing (env_init sp)) (map row (beginning sp g)).

(** * What a strategy does *)

Definition told (sp : spec) (i : state) (u : node) : bool :=
  forallb (fun x => N.eqb (get (row u) x) (i x)) (seq 0 (inputs sp)).

Fixpoint node_at (sp : spec) (g : graph) (h : list state) : option node :=
  match h with
  | [] => None
  | [i] => find (told sp i) (beginning sp g)
  | i :: h => match node_at sp g h with
              | Some u => match look g (next u) with
                          | Some vs => find (told sp i) vs
                          | None => None
                          end
              | None => None
              end
  end.

Definition strategy_of (sp : spec) (g : graph) : strategy :=
  fun h => match node_at sp g h with Some u => state_of u | None => fun _ => 0%N end.

(** * Soundness *)

Section Sound.
Variables (sp : spec) (g : graph).
Hypothesis checked : check sp g = true.

Lemma inputs_few : inputs sp <= length (ranges sp).
Proof.
  unfold check in checked. rewrite !andb_true_iff in checked. apply Nat.leb_le. tauto.
Qed.

Lemma node_checked u : In u (all_of g) -> check_node sp g u = true.
Proof.
  unfold check in checked. rewrite !andb_true_iff, forallb_forall in checked.
  destruct checked as ((_ & H) & _). auto.
Qed.

Lemma now_agrees u s' : agrees (now_is (row u)) (state_of u) s'.
Proof. intros [x | x] n E; cbn in E; [injection E as <-; reflexivity | discriminate]. Qed.

Lemma in_ranges_ok rs : forall ns, in_ranges rs ns = true ->
  length ns = length rs /\
  forall x lo hi, nth_error rs x = Some (lo, hi) -> (lo <= get ns x <= hi)%N.
Proof.
  induction rs as [| (lo, hi) rs IH]; intros [| n ns] H; cbn in H; try discriminate.
  - split; auto. intros [] ? ? E; discriminate.
  - destruct (N.leb_spec lo n) as [L | L]; [| discriminate].
    destruct (N.leb_spec n hi) as [M | M]; [| discriminate].
    apply IH in H as (E & H). split; [cbn; auto |].
    intros [| x] lo' hi' Q; cbn in Q.
    + injection Q as <- <-. unfold get; cbn; auto.
    + exact (H x lo' hi' Q).
Qed.

(** An edge from [u] to [v]. *)
Definition edge (u v : node) : Prop := exists vs, look g (next u) = Some vs /\ In v vs.

Lemma node_parts u : In u (all_of g) -> exists vs, look g (next u) = Some vs /\
  in_ranges (ranges sp) (row u) = true /\
  (forall v, In v vs ->
     sats (state_of u) (state_of v) (env_trans sp) = true /\
     sats (state_of u) (state_of v) (sys_trans sp) = true /\
     progresses (env_live sp) (sys_live sp) (state_of u) (state_of v) (rank_of u) (rank_of v)
     = true) /\
  cover true (input_values sp) (simps (now_is (row u)) (env_trans sp)) (map row vs) = true.
Proof.
  intros I. apply node_checked in I. unfold check_node in I.
  destruct (look g (next u)) as [vs |] eqn:L; [| discriminate]. exists vs; split; auto.
  rewrite !andb_true_iff in I. destruct I as (((((R & _) & E) & C) & _) & _).
  repeat split; auto;
    rewrite forallb_forall in E; pose proof (E _ H) as E'; unfold check_edge in E';
    destruct (sats (state_of u) (state_of v) (simps (now_is (row u)) (env_trans sp) ++
       simps (now_is (row u)) (sys_trans sp))) eqn:Q; try discriminate;
    unfold sats in Q; rewrite forallb_app, andb_true_iff in Q; destruct Q as (Q & Q').
  - rewrite <- (simps_ok _ _ _ _ (now_agrees u (state_of v))); auto.
  - rewrite <- (simps_ok _ _ _ _ (now_agrees u (state_of v))); auto.
  - auto.
Qed.

Lemma edge_ok u v : In u (all_of g) -> edge u v -> In v (all_of g) /\
  sats (state_of u) (state_of v) (env_trans sp) = true /\
  sats (state_of u) (state_of v) (sys_trans sp) = true /\
  progresses (env_live sp) (sys_live sp) (state_of u) (state_of v) (rank_of u) (rank_of v) = true.
Proof.
  intros I (vs & L & J). split; [eapply look_in; eauto |].
  destruct (node_parts u I) as (vs' & L' & _ & H & _).
  rewrite L in L'; injection L' as <-. auto.
Qed.

Lemma get_beyond u x : In u (all_of g) -> length (ranges sp) <= x -> state_of u x = 0%N.
Proof.
  intros I L. destruct (node_parts u I) as (_ & _ & R & _).
  apply in_ranges_ok in R as (E & _). unfold state_of, get. apply nth_overflow. lia.
Qed.

(** Each possible input has a successor. *)
Theorem answers u i : In u (all_of g) ->
  (forall x, x < inputs sp -> within sp i x) ->
  sats (state_of u) i (env_trans sp) = true ->
  exists v, edge u v /\ forall x, x < inputs sp -> state_of v x = i x.
Proof.
  intros I W E. destruct (node_parts u I) as (vs & L & _ & _ & C).
  apply cover_ok with (s := state_of u) (s' := i) in C as (r & J & H).
  - apply in_map_iff in J as (v & <- & J). exists v; split; [exists vs; auto |].
    intros x X. destruct (input_in sp x X) as (ns & K); [pose proof inputs_few; lia |].
    exact (H x ns K).
  - apply has_inputs; auto.
  - rewrite (simps_ok _ _ _ _ (now_agrees u i)); auto.
Qed.

Theorem answers_first i :
  (forall x, x < inputs sp -> within sp i x) ->
  sats i i (env_init sp) = true ->
  exists v, In v (beginning sp g) /\ forall x, x < inputs sp -> state_of v x = i x.
Proof.
  intros W E. pose proof checked as C. unfold check in C. rewrite !andb_true_iff in C.
  destruct C as (_ & C). apply cover_ok with (s := i) (s' := i) in C as (r & J & H); auto.
  - apply in_map_iff in J as (v & <- & J). exists v; split; auto.
    intros x X. destruct (input_in sp x X) as (ns & K); [pose proof inputs_few; lia |].
    exact (H x ns K).
  - apply has_inputs; auto.
  - rewrite simps_ok; auto. intros r n Q; discriminate.
Qed.

Lemma begins_ok u : In u (beginning sp g) -> In u (all_of g) /\
  sats (state_of u) (state_of u) (env_init sp) = true /\
  sats (state_of u) (state_of u) (sys_init sp) = true.
Proof.
  intros I. apply filter_In in I as (I & B). split; auto. unfold begins in B.
  destruct (sats (state_of u) (state_of u) (env_init sp)); auto; discriminate.
Qed.

(** Every infinite path from a node keeps the system's rules, and starves no goal. *)
Theorem paths_safe (p : nat -> node) :
  In (p O) (all_of g) -> (forall k, edge (p k) (p (S k))) ->
  forall k, In (p k) (all_of g) /\ sats (state_of (p k)) (state_of (p (S k))) (sys_trans sp) = true.
Proof.
  intros B E. assert (forall k, In (p k) (all_of g)) as A.
  { intros k; induction k as [| k IH]; [auto |]. exact (proj1 (edge_ok _ _ IH (E k))). }
  intros k; split; auto. destruct (edge_ok _ _ (A k) (E k)) as (_ & _ & H & _); auto.
Qed.

Theorem paths_live (p : nat -> node) :
  In (p O) (all_of g) -> (forall k, edge (p k) (p (S k))) ->
  let b := fun k => state_of (p k) in
  (forall a, In a (env_live sp) -> again b a) -> forall goal, In goal (sys_live sp) -> again b goal.
Proof.
  intros B E b A goal I. apply In_nth_error in I as (j & J).
  apply (measured b (fun k => nth j (rank_of (p k)) (0%N, None)) (env_live sp) goal); auto.
  intros k. destruct (paths_safe p B E k) as (I & _).
  destruct (edge_ok _ _ I (E k)) as (_ & _ & _ & P).
  eapply progresses_nth; eauto.
Qed.

(** * The strategy realizes the specification *)

Lemma told_ok i u : told sp i u = true <-> forall x, x < inputs sp -> state_of u x = i x.
Proof.
  unfold told. rewrite forallb_forall. split; intros H x L.
  - apply N.eqb_eq, H, in_seq. lia.
  - apply in_seq in L. apply N.eqb_eq, H. lia.
Qed.

Section Play.
Variable i : nat -> state.
Hypothesis proper : forall k x, x < inputs sp -> within sp (i k) x.
Let b := play sp (strategy_of sp g) i.

(** The strategy is in node [u] after input [k]. *)
Definition is_at (k : nat) (u : node) : Prop :=
  node_at sp g (past i k) = Some u /\ In u (all_of g) /\ (forall x, b k x = state_of u x).

Lemma is_at_intro k u : node_at sp g (past i k) = Some u -> In u (all_of g) ->
  (forall x, x < inputs sp -> state_of u x = i k x) -> is_at k u.
Proof.
  intros N I T. split; [auto | split; [auto |]]. intros x. unfold b, play, strategy_of.
  destruct (Nat.ltb_spec x (inputs sp)) as [L | L]; [rewrite T; auto |].
  destruct (Nat.ltb_spec x (length (ranges sp))) as [L' | L'].
  - rewrite N; reflexivity.
  - symmetry; apply get_beyond; auto.
Qed.

(** [env_init] refers to inputs only, so any state with the same inputs satisfies it. *)
Lemma at_first : sats (b O) (b O) (env_init sp) = true ->
  exists u, is_at O u /\ In u (beginning sp g).
Proof.
  intros E. destruct (answers_first (b O)) as (v & I & H); auto.
  { intros x X. unfold b, play, within. rewrite (proj2 (Nat.ltb_lt _ _) X). apply proper; auto. }
  assert (exists u, find (told sp (i O)) (beginning sp g) = Some u) as (u & Q).
  { destruct (find (told sp (i O)) (beginning sp g)) as [u |] eqn:Q; [exists u; auto |].
    eapply find_none in Q; eauto. exfalso. rewrite <- not_true_iff_false in Q. apply Q, told_ok.
    intros x X. rewrite H; auto. unfold b, play. rewrite (proj2 (Nat.ltb_lt _ _) X). reflexivity. }
  destruct (find_some _ _ Q) as (I' & Q'). exists u; split; auto.
  apply is_at_intro; auto.
  - apply begins_ok in I' as (I' & _); auto.
  - apply told_ok; auto.
Qed.

Lemma past_cons k : past i (S k) = i (S k) :: past i k.
Proof. reflexivity. Qed.

Lemma node_at_cons k u vs : node_at sp g (past i k) = Some u -> look g (next u) = Some vs ->
  node_at sp g (past i (S k)) = find (told sp (i (S k))) vs.
Proof.
  intros N L. rewrite past_cons. destruct (past i k) as [| s h] eqn:P.
  - destruct k; discriminate.
  - change (node_at sp g (i (S k) :: s :: h)) with
      (match node_at sp g (s :: h) with
       | Some u => match look g (next u) with
                   | Some vs => find (told sp (i (S k))) vs | None => None end
       | None => None end).
    rewrite N, L. reflexivity.
Qed.

Lemma at_next k u : is_at k u -> sats (b k) (b (S k)) (env_trans sp) = true ->
  exists v, is_at (S k) v /\ edge u v.
Proof.
  intros (N & I & V) E.
  assert (sats (state_of u) (b (S k)) (env_trans sp) = true) as E'.
  { rewrite <- E. apply sats_ext; auto. }
  apply answers in E' as (v & (vs & L & J) & H); auto.
  2: { intros x X. unfold b, play, within. rewrite (proj2 (Nat.ltb_lt _ _) X). apply proper; auto. }
  assert (exists w, find (told sp (i (S k))) vs = Some w) as (w & Q).
  { destruct (find (told sp (i (S k))) vs) as [w |] eqn:Q; [exists w; auto |].
    eapply find_none in Q; eauto. exfalso. rewrite <- not_true_iff_false in Q. apply Q, told_ok.
    intros x X. rewrite H; auto. unfold b, play. rewrite (proj2 (Nat.ltb_lt _ _) X). reflexivity. }
  destruct (find_some _ _ Q) as (J' & Q'). exists w; split; [| exists vs; auto].
  apply is_at_intro.
  - rewrite (node_at_cons k u vs); auto.
  - eapply look_in; eauto.
  - apply told_ok; auto.
Qed.

Lemma at_all k : env_ok sp b k -> exists u, is_at k u.
Proof.
  induction k as [| k IH]; intros (E & E').
  - destruct (at_first E) as (u & H & _). exists u; auto.
  - destruct IH as (u & H); [split; auto |].
    destruct (at_next k u H) as (v & H' & _); [apply E'; lia | exists v; auto].
Qed.

Lemma is_at_unique k u v : is_at k u -> is_at k v -> u = v.
Proof. intros (N & _) (N' & _). rewrite N in N'. injection N'; auto. Qed.

Lemma at_edge k u v : is_at k u -> is_at (S k) v ->
  sats (b k) (b (S k)) (env_trans sp) = true -> edge u v.
Proof.
  intros A A' E. destruct (at_next k u A E) as (w & A'' & D).
  rewrite (is_at_unique _ _ _ A' A''); auto.
Qed.

Lemma play_safe k : env_ok sp b k -> sys_ok sp b k.
Proof.
  intros H. split; [| split].
  - destruct (at_first (proj1 H)) as (u & (_ & _ & V) & B).
    destruct (begins_ok u B) as (_ & _ & S'). rewrite <- S'. apply sats_ext; auto.
  - intros j L. destruct (at_all j) as (u & A); [split; [apply H | intros; apply H; lia] |].
    destruct (at_next j u A) as (v & A' & D); [apply H; lia |].
    destruct A as (_ & I & V), A' as (_ & _ & V').
    destruct (edge_ok u v I D) as (_ & _ & S' & _). rewrite <- S'. apply sats_ext; auto.
  - intros j x L _. destruct (at_all j) as (u & _ & I & V).
    { split; [apply H | intros; apply H; lia]. }
    destruct (node_parts u I) as (_ & _ & R & _). apply in_ranges_ok in R as (_ & R).
    intros lo hi E. rewrite V. apply (R x lo hi E).
Qed.

Lemma play_live : (forall k, env_ok sp b k) ->
  (forall a, In a (env_live sp) -> again b a) -> forall goal, In goal (sys_live sp) -> again b goal.
Proof.
  intros H A goal G.
  set (dflt := {| row := []; next := []; rank_of := [] |}).
  set (p := fun k => match node_at sp g (past i k) with Some u => u | None => dflt end).
  assert (forall k, is_at k (p k)) as P.
  { intros k. destruct (at_all k (H k)) as (u & Q). unfold p. pose proof Q as (N & _).
    rewrite N. auto. }
  assert (forall k f, sat (b k) (b (S k)) f = sat (state_of (p k)) (state_of (p (S k))) f) as X.
  { intros k f. apply sat_ext; apply P. }
  assert (forall f, again b f <-> again (fun k => state_of (p k)) f) as Y.
  { intros f; split; intros Q k; destruct (Q k) as (j & L & M); exists j; split; auto;
      rewrite <- M; auto. }
  apply Y. apply (paths_live p); auto.
  - apply (P O).
  - intros k. apply (at_edge k); auto. apply (proj2 (H (S k)) k). lia.
  - intros a I. apply Y; auto.
Qed.
End Play.

(** The main theorem. *)
Theorem check_realizes : realizes sp (strategy_of sp g).
Proof.
  intros i W. split; [exact (play_safe i W) | exact (play_live i W)].
Qed.
End Sound.
