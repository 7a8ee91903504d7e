(** A counterstrategy as a graph with ranks, and a check that it leaves no strategy. *)
From Coq Require Import List NArith PArith Arith Bool Lia FMapPositive.
From Proved Require Import Gr1 Simplify Ranks Strategy.
Import ListNotations.

(** For each node the next input that the environment chooses, and its ranks: one for each
    assumption, then one whose excuses are the goals. *)
Record cnode := { base : node; chosen : list N }.
Definition cgraph := PositiveMap.t cnode.

Definition cstate (u : cnode) : state := state_of (base u).

(** What is known at first, and before the robot's reply. *)
Definition first_is (n : nat) (i : list N) : known :=
  fun r => match r with Now x => if Nat.ltb x n then Some (get i x) else None | Next _ => None end.
Definition then_is (n : nat) (r i : list N) : known :=
  fun x => match x with
           | Now x => Some (get r x)
           | Next x => if Nat.ltb x n then Some (get i x) else None
           end.

Definition inputs_are (sp : spec) (i : list N) (u : cnode) : bool :=
  same_inputs (inputs sp) i (row (base u)).

Definition legal_input (sp : spec) (i : list N) : bool :=
  in_ranges (firstn (inputs sp) (ranges sp)) i.

Definition is_nil {A} (l : list A) : bool := match l with [] => true | _ => false end.

Definition crow (u : cnode) : list N := row (base u).

Definition cprogress (sp : spec) (u v : cnode) : bool :=
  let n := length (env_live sp) in
  progresses [] (env_live sp) (cstate u) (cstate v) (rank_of (base u)) (rank_of (base v))
  && match nth_error (rank_of (base u)) n, nth_error (rank_of (base v)) n with
     | Some m, Some m' => progress (sys_live sp) F (cstate u) (cstate v) m m'
     | _, _ => false
     end.

Definition check_cnode (sp : spec) (g : cgraph) (u : cnode) : bool :=
  match look g (next (base u)) with
  | None => false
  | Some vs =>
      let k := then_is (inputs sp) (crow u) (chosen u) in
      let vs := filter (inputs_are sp (chosen u)) vs in
      in_ranges (ranges sp) (crow u)
      && legal_input sp (chosen u)
      && is_nil (simps k (env_trans sp))
      && cover true (output_values sp) (simps k (sys_trans sp)) (map crow vs)
      && forallb (cprogress sp u) vs
      && forallb (rank_ok 0) (firstn (length (env_live sp)) (rank_of (base u)))
      && forallb (rank_ok (length (sys_live sp))) (skipn (length (env_live sp)) (rank_of (base u)))
  end.

Definition cbeginning (sp : spec) (g : cgraph) (start : list N) : list cnode :=
  filter (inputs_are sp start) (all_of g).

Definition check_counter (sp : spec) (g : cgraph) (start : list N) : bool :=
  let k := first_is (inputs sp) start in
  Nat.leb (inputs sp) (length (ranges sp))
  && legal_input sp start
  && is_nil (simps k (env_init sp))
  && cover false (output_values sp) (simps k (sys_init sp)) (map crow (cbeginning sp g start))
  && forallb (check_cnode sp g) (all_of g).

(** * Soundness *)

Section Sound.
Variables (sp : spec) (g : cgraph) (start : list N) (f : strategy).
Hypothesis checked : check_counter sp g start = true.

(** What the robot has done, as a node tells it. *)
Definition did (s : state) (u : cnode) : bool :=
  forallb (fun x => N.eqb (get (crow u) x) (s x)) (seq (inputs sp) (length (ranges sp) - inputs sp)).

(** The inputs so far, and the node. *)
Fixpoint conf (k : nat) : list state * option cnode :=
  match k with
  | O => let h := [get start] in (h, find (did (f h)) (cbeginning sp g start))
  | S k =>
      let (h, u) := conf k in
      match u with
      | Some u =>
          let h := get (chosen u) :: h in
          (h, match look g (next (base u)) with
              | Some vs => find (did (f h)) (filter (inputs_are sp (chosen u)) vs)
              | None => None
              end)
      | None => (get start :: h, None)
      end
  end.

Definition env (k : nat) : state := hd (get start) (fst (conf k)).
Let b := play sp f env.

Lemma past_conf k : past env k = fst (conf k).
Proof.
  induction k as [| k IH]; [reflexivity |].
  change (past env (S k)) with (env (S k) :: past env k). rewrite IH.
  unfold env. cbn [conf]. destruct (conf k) as (h, [u |]); reflexivity.
Qed.

Lemma cparts :
  inputs sp <= length (ranges sp) /\ legal_input sp start = true /\
  simps (first_is (inputs sp) start) (env_init sp) = [] /\
  cover false (output_values sp) (simps (first_is (inputs sp) start) (sys_init sp))
    (map crow (cbeginning sp g start)) = true /\
  forall u, In u (all_of g) -> check_cnode sp g u = true.
Proof.
  pose proof checked as C. unfold check_counter in C. rewrite !andb_true_iff, forallb_forall in C.
  destruct C as ((((A & B) & C) & D) & E). split; [apply Nat.leb_le; auto |].
  repeat split; auto. destruct (simps _ (env_init sp)); auto; discriminate.
Qed.

Lemma legal_within i : legal_input sp i = true ->
  forall x, x < inputs sp -> within sp (get i) x.
Proof.
  intros L x X lo hi E. unfold legal_input in L. apply in_ranges_ok in L as (_ & R).
  apply (R x lo hi). rewrite <- E.
  clear - X. revert x X. generalize (ranges sp) as rs. induction (inputs sp) as [| n IH];
    intros rs x X; [lia |]. destruct rs as [| r rs]; [destruct x; reflexivity |].
  destruct x as [| x]; [reflexivity |]. cbn. apply IH. lia.
Qed.

Lemma same_inputs_ok n : forall i r, same_inputs n i r = true ->
  forall x, x < n -> get i x = get r x.
Proof.
  induction n as [| n IH]; intros i r H x X; [lia |].
  destruct i as [| a i], r as [| a' r]; cbn in H; try discriminate.
  destruct (N.eqb_spec a a') as [-> | D]; [| discriminate].
  destruct x as [| x]; [reflexivity |]. apply (IH i r H x). lia.
Qed.

Lemma did_ok s u : did s u = true <->
  forall x, inputs sp <= x < length (ranges sp) -> cstate u x = s x.
Proof.
  unfold did. rewrite forallb_forall. pose proof (proj1 cparts) as L. split; intros H x X.
  - apply N.eqb_eq, H, in_seq. lia.
  - apply in_seq in X. apply N.eqb_eq, H. lia.
Qed.

Lemma cnode_parts u : In u (all_of g) -> exists vs, look g (next (base u)) = Some vs /\
  let k := then_is (inputs sp) (crow u) (chosen u) in
  let ws := filter (inputs_are sp (chosen u)) vs in
  in_ranges (ranges sp) (crow u) = true /\ legal_input sp (chosen u) = true /\
  simps k (env_trans sp) = [] /\
  cover true (output_values sp) (simps k (sys_trans sp)) (map crow ws) = true /\
  forall v, In v ws -> cprogress sp u v = true.
Proof.
  intros I. apply cparts in I. unfold check_cnode in I.
  destruct (look g (next (base u))) as [vs |] eqn:L; [| discriminate]. exists vs; split; auto.
  cbv zeta in *. rewrite !andb_true_iff in I.
  destruct I as ((((((A & B) & C) & D) & E) & _) & _). rewrite forallb_forall in E.
  repeat split; auto.
  destruct (simps _ (env_trans sp)); auto; discriminate.
Qed.

(** After [k] steps the run is in a node, which says what has happened. *)
Definition is_in (k : nat) (u : cnode) : Prop :=
  snd (conf k) = Some u /\ In u (all_of g) /\ (forall x, b k x = cstate u x) /\ env_ok sp b k.

Lemma beyond u x : In u (all_of g) -> length (ranges sp) <= x -> cstate u x = 0%N.
Proof.
  intros I L. destruct (cnode_parts u I) as (_ & _ & R & _).
  apply in_ranges_ok in R as (E & _). apply nth_overflow. unfold crow in E. lia.
Qed.

Lemma b_input k x : x < inputs sp -> b k x = env k x.
Proof. intros X. unfold b, play. rewrite (proj2 (Nat.ltb_lt _ _) X). reflexivity. Qed.

Lemma env_proper k x : x < inputs sp -> within sp (env k) x.
Proof.
  intros X. destruct cparts as (_ & L & _).
  assert (forall k, (forall u, snd (conf k) = Some u -> In u (all_of g)) /\
                    within sp (env k) x) as H; [| apply H].
  clear k. intros k; induction k as [| k (IH & _)].
  - split; [| apply legal_within; auto]. intros u E. cbn in E. apply find_some in E as (E & _).
    apply filter_In in E. tauto.
  - unfold env in *. cbn [conf]. destruct (conf k) as (h, [u |]); cbn [fst snd hd] in *.
    + specialize (IH u eq_refl). destruct (cnode_parts u IH) as (vs & Q & _ & M & _).
      rewrite Q. split; [| apply legal_within; auto].
      intros v E. apply find_some in E as (E & _). apply filter_In in E as (E & _).
      eapply look_in; eauto.
    + split; [discriminate | apply legal_within; auto].
Qed.

Section Against.
Hypothesis kept : realizes sp f.

Lemma sys_fine k : env_ok sp b k -> sys_ok sp b k.
Proof. apply (proj1 (kept env env_proper)). Qed.

Lemma found_by (us : list cnode) (h : state) (s : state) row' :
  In row' (map crow us) ->
  (forall x ns, In (x, ns) (output_values sp) -> get row' x = s x) ->
  (forall x, inputs sp <= x < length (ranges sp) -> s x = h x) ->
  exists u, find (did h) us = Some u.
Proof.
  intros I G H. apply in_map_iff in I as (u & <- & I).
  destruct (find (did h) us) as [v |] eqn:Q; [exists v; auto |].
  eapply find_none in Q; eauto. exfalso. rewrite <- not_true_iff_false in Q. apply Q, did_ok.
  intros x X. rewrite <- H by auto. destruct (output_in sp x) as (ns & J); [lia | lia |].
  exact (G x ns J).
Qed.

Lemma in_first : exists u, is_in O u.
Proof.
  destruct cparts as (L & St & E & C & _).
  assert (agrees (first_is (inputs sp) start) (b O) (b O)) as A.
  { intros [x | x] n Q; unfold first_is in Q; [| discriminate]. destruct (Nat.ltb_spec x (inputs sp));
      [| discriminate]. injection Q as <-. cbn. rewrite b_input; auto. }
  assert (env_ok sp b O) as K.
  { split; [| lia]. rewrite <- (simps_ok _ _ _ _ A), E. reflexivity. }
  destruct (sys_fine O K) as (S0 & _ & R).
  apply cover_ok with (s := b O) (s' := b O) in C as (r & I & G).
  - destruct (found_by _ (f [get start]) (b O) r I G) as (u & Q).
    { intros x X. unfold b, play. destruct (Nat.ltb_spec x (inputs sp)); [lia |].
      destruct (Nat.ltb_spec x (length (ranges sp))); [reflexivity | lia]. }
    exists u. destruct (find_some _ _ Q) as (I' & D). apply filter_In in I' as (I' & D').
    split; [exact Q | split; [auto | split; [| auto]]]. intros x.
    destruct (Nat.lt_ge_cases x (inputs sp)) as [X | X].
    + rewrite b_input; auto. apply (same_inputs_ok _ _ _ D' x X).
    + unfold b, play. destruct (Nat.ltb_spec x (inputs sp)); [lia |].
      destruct (Nat.ltb_spec x (length (ranges sp))) as [Y | Y].
      * symmetry. apply did_ok with (1 := D). lia.
      * symmetry. apply beyond; auto.
  - apply has_outputs. intros x X. apply R; auto.
  - rewrite (simps_ok _ _ _ _ A); auto.
Qed.

Lemma in_next k u : is_in k u -> exists v, is_in (S k) v /\ cprogress sp u v = true.
Proof.
  intros (N & I & V & K). destruct (cnode_parts u I) as (vs & L & R & M & E & C & P).
  cbv zeta in *. set (ws := filter (inputs_are sp (chosen u)) vs) in *.
  assert (forall x, env (S k) x = get (chosen u) x) as W.
  { intros x. unfold env. cbn [conf]. destruct (conf k) as (h, o). cbn in N. rewrite N. reflexivity. }
  assert (agrees (then_is (inputs sp) (crow u) (chosen u)) (b k) (b (S k))) as A.
  { intros [x | x] n Q; unfold then_is in Q; [injection Q as <-; cbn; rewrite V; reflexivity |].
    destruct (Nat.ltb_spec x (inputs sp)); [| discriminate]. injection Q as <-. cbn.
    rewrite b_input by auto. apply W. }
  assert (env_ok sp b (S k)) as K'.
  { split; [apply K |]. intros j J. destruct (Nat.eq_dec j k) as [-> | D]; [| apply K; lia].
    rewrite <- (simps_ok _ _ _ _ A), E. reflexivity. }
  destruct (sys_fine (S k) K') as (_ & S1 & R').
  apply cover_ok with (s := b k) (s' := b (S k)) in C as (r & J & G).
  - assert (past env (S k) = get (chosen u) :: fst (conf k)) as H.
    { rewrite past_conf. cbn [conf]. destruct (conf k) as (h, o). cbn in N. rewrite N. reflexivity. }
    assert (forall x, inputs sp <= x < length (ranges sp) ->
      b (S k) x = f (get (chosen u) :: fst (conf k)) x) as B.
    { intros x X. unfold b, play. destruct (Nat.ltb_spec x (inputs sp)); [lia |].
      destruct (Nat.ltb_spec x (length (ranges sp))); [| lia]. rewrite H. reflexivity. }
    destruct (found_by ws _ (b (S k)) r J G B) as (v & Q).
    exists v. destruct (find_some _ _ Q) as (J' & D). split; [| auto].
    pose proof J' as J''. unfold ws in J''. apply filter_In in J'' as (J'' & D').
    assert (In v (all_of g)) as I' by (eapply look_in; eauto).
    split; [| split; [auto | split; [| auto]]].
    + cbn [conf]. destruct (conf k) as (h, o). cbn in N. rewrite N. cbn. rewrite L. exact Q.
    + intros x. destruct (Nat.lt_ge_cases x (inputs sp)) as [X | X].
      * rewrite b_input, W by auto. apply (same_inputs_ok _ _ _ D' x X).
      * destruct (Nat.lt_ge_cases x (length (ranges sp))) as [Y | Y].
        -- rewrite B by lia. symmetry. apply did_ok with (1 := D). lia.
        -- rewrite beyond by auto. unfold b, play. destruct (Nat.ltb_spec x (inputs sp)); [lia |].
           destruct (Nat.ltb_spec x (length (ranges sp))); [lia | reflexivity].
  - apply has_outputs. intros x X. apply R'; auto.
  - rewrite (simps_ok _ _ _ _ A). apply S1. lia.
Qed.

Lemma in_all k : exists u, is_in k u.
Proof.
  induction k as [| k (u & IH)]; [exact in_first |].
  destruct (in_next k u IH) as (v & H & _). exists v; auto.
Qed.

Definition nowhere : cnode :=
  {| base := {| row := []; next := []; rank_of := [] |}; chosen := [] |}.
Definition path (k : nat) : cnode := match snd (conf k) with Some u => u | None => nowhere end.

Lemma on_path k : is_in k (path k).
Proof.
  destruct (in_all k) as (u & H). unfold path. pose proof H as (E & _). rewrite E. auto.
Qed.

Lemma path_progress k : cprogress sp (path k) (path (S k)) = true.
Proof.
  destruct (in_next k _ (on_path k)) as (v & (E & _) & P).
  pose proof (on_path (S k)) as (E' & _). rewrite E in E'. injection E' as <-. auto.
Qed.

Lemma progress_ext ex goal s s' t t' m m' : (forall x, s x = t x) -> (forall x, s' x = t' x) ->
  progress ex goal s s' m m' = progress ex goal t t' m m'.
Proof.
  intros E E'. unfold progress, falls. rewrite (sat_ext s s' t t' goal E E').
  destruct (snd m) as [a |], (snd m') as [a' |]; auto.
  destruct (nth_error ex a) as [h |]; auto. rewrite (sat_ext s s' t t' h E E'). reflexivity.
Qed.

Lemma assumptions_met a : In a (env_live sp) -> again b a.
Proof.
  intros I. apply In_nth_error in I as (j & J).
  apply (measured b (fun k => nth j (rank_of (base (path k))) (0%N, None)) [] a); [| intros ? []].
  intros k. pose proof (path_progress k) as P. unfold cprogress in P.
  apply andb_true_iff in P as (P & _). eapply progresses_nth in P; eauto.
  rewrite <- P. apply progress_ext; intros x; [apply (on_path k) | apply (on_path (S k))].
Qed.

Lemma absurd : False.
Proof.
  assert (forall k, env_ok sp b k) as K by (intros k; apply (on_path k)).
  assert (forall goal, In goal (sys_live sp) -> again b goal) as G.
  { apply (proj2 (kept env env_proper)); auto. exact assumptions_met. }
  assert (again b F) as N.
  { apply (measured b (fun k => nth (length (env_live sp)) (rank_of (base (path k))) (0%N, None))
             (sys_live sp) F); auto.
    intros k. pose proof (path_progress k) as P. unfold cprogress in P.
    apply andb_true_iff in P as (_ & P).
    destruct (nth_error (rank_of (base (path k))) (length (env_live sp))) as [m |] eqn:E;
      [| discriminate].
    destruct (nth_error (rank_of (base (path (S k)))) (length (env_live sp))) as [m' |] eqn:E';
      [| discriminate].
    rewrite (nth_error_nth _ _ _ E), (nth_error_nth _ _ _ E'). rewrite <- P.
    apply progress_ext; intros x; [apply (on_path k) | apply (on_path (S k))]. }
  destruct (N O) as (j & _ & H). discriminate.
Qed.
End Against.
End Sound.

Theorem check_counter_sound sp g start :
  check_counter sp g start = true -> ~ realizable sp.
Proof. intros C (f & R). exact (absurd sp g start f C R). Qed.
