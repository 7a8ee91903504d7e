(** Possible observations of the other robots, and that the strategy has a successor for each: no
    assumption about the others is stronger than the world. For robots that observe which
    neighbouring regions are occupied ([nearby]). Other inputs do not depend on these observations.
    *)
From Coq Require Import List NArith PArith Arith Bool Lia FMapPositive.
From Proved Require Import Gr1 Simplify Ranks Strategy Parse World Team.
Import ListNotations.
Local Open Scope N_scope.

Section Views.
Variable w : world.

(** A robot can be on a side if the region there is free. *)
Definition neighbour (d : side) (a : N) : N :=
  match d with North => a - columns w | South => a + columns w | West => a - 1 | East => a + 1 end.
Definition opens (d : side) (a : N) : bool :=
  let b := neighbour d a in beside w d a b && free w b.

(** Whether a robot is observed on each side: at most as many as there are other robots. *)
Definition possible (c : controller) (a : N) (view : side -> bool) : Prop :=
  (forall d, view d = true -> exists b, beside w d a b = true /\ free w b = true) /\
  (length (filter (fun dy => view (fst dy)) (sees (vars c))) <= crowd c)%nat.

Definition shows (p : places) (v : node) (view : side -> bool) : bool :=
  forallb (fun dy => state_of v (snd dy) =? if view (fst dy) then 1 else 0) (sees p).

Definition quiet (p : places) (v : node) : bool := shows p v (fun _ => false).

(** All other inputs are the same. *)
Definition like (c : controller) (v v' : node) : bool :=
  forallb (fun x => existsb (fun dy => Nat.eqb (snd dy) x) (sees (vars c)) || (state_of v x =? state_of v' x))
          (seq 0 (signals c)).

(** All sets of sides on which robots can be. *)
Fixpoint sets (ds : list side) : list (list side) :=
  match ds with [] => [[]] | d :: ds => let l := sets ds in l ++ map (cons d) l end.
Definition same_side (d e : side) : bool := number_of d =? number_of e.
Definition member (ds : list side) (d : side) : bool := existsb (same_side d) ds.

Definition check_views_node (c : controller) (u : node) : bool :=
  match look (nodes c) (next u) with
  | None => false
  | Some vs =>
      let sides := filter (fun d => opens d (at_ c u)) (map fst (sees (vars c))) in
      let views := filter (fun ds => Nat.leb (length ds) (crowd c)) (sets sides) in
      let still := filter (quiet (vars c)) vs in
      match still with [] => false | _ =>
        forallb (fun ds =>
          let seen := filter (fun v => shows (vars c) v (member ds)) vs in
          forallb (fun v => existsb (like c v) seen) still) views
      end
  end.

Fixpoint once (ds : list side) : bool :=
  match ds with [] => true | d :: ds => if member ds d then false else once ds end.

Definition check_views (c : controller) : bool :=
  negb (columns w =? 0) && once (map fst (sees (vars c))) &&
  forallb (check_views_node c) (all_of (nodes c)).

(** * Soundness *)

Lemma same_side_ok d e : same_side d e = true <-> d = e.
Proof. destruct d, e; cbn; split; intros; congruence. Qed.

Lemma member_ok ds d : member ds d = true <-> In d ds.
Proof.
  unfold member. rewrite existsb_exists. split.
  - intros (e & I & E). apply same_side_ok in E. subst; auto.
  - intros I. exists d. split; auto. apply same_side_ok; auto.
Qed.

Lemma beside_neighbour d a b : columns w <> 0 -> beside w d a b = true -> b = neighbour d a.
Proof.
  intros C B. unfold beside, row_of, column_of in B.
  pose proof (N.div_mod a (columns w) C) as A. pose proof (N.div_mod b (columns w) C) as B'.
  unfold neighbour. destruct d; apply andb_true_iff in B as (E & E'); apply N.eqb_eq in E, E'; nia.
Qed.

Lemma sets_in ds (f : side -> bool) : In (filter f ds) (sets ds).
Proof.
  induction ds as [| d ds IH]; [left; auto |]. cbn. apply in_or_app.
  destruct (f d); [right; apply in_map; auto | left; auto].
Qed.

Lemma filter_map_length {A B} (f : B -> bool) (g : A -> B) l :
  length (filter f (map g l)) = length (filter (fun a => f (g a)) l).
Proof. induction l as [| a l IH]; [auto |]. cbn. destruct (f (g a)); cbn; auto. Qed.

Lemma filter_and {A} (f g : A -> bool) l : (forall a, In a l -> g a = true -> f a = true) ->
  filter g (filter f l) = filter g l.
Proof.
  induction l as [| a l IH]; [auto |]. intros H. cbn. destruct (f a) eqn:F; cbn.
  - destruct (g a); rewrite IH; auto; intros; apply H; auto; right; auto.
  - rewrite IH by (intros; apply H; auto; right; auto).
    destruct (g a) eqn:G; auto. rewrite (H a) in F; auto; [discriminate | left; auto].
Qed.

(** Each possible view has a successor, for all other inputs that have one when no robot is
    observed; and there is one then. *)
Theorem views_answered c u : check_views c = true -> In u (all_of (nodes c)) ->
  (exists v, edge (nodes c) u v /\ quiet (vars c) v = true) /\
  forall v view, edge (nodes c) u v -> quiet (vars c) v = true -> possible c (at_ c u) view ->
  exists v', edge (nodes c) u v' /\ shows (vars c) v' view = true /\ like c v v' = true.
Proof.
  intros K U. unfold check_views in K. rewrite !andb_true_iff in K. destruct K as ((Z & _) & K).
  rewrite negb_true_iff, N.eqb_neq in Z.
  rewrite forallb_forall in K. specialize (K u U). unfold check_views_node, edge in *.
  destruct (look (nodes c) (next u)) as [vs |]; [| discriminate].
  set (still := filter (quiet (vars c)) vs) in *.
  destruct still as [| v0 rest] eqn:St; [discriminate |]. rewrite <- St in K. split.
  - exists v0. assert (In v0 still) as I by (rewrite St; left; auto).
    apply filter_In in I as (I & Q). split; [exists vs; auto | auto].
  - intros v view (vs' & Eq & I) Q (P & Cr). injection Eq as <-.
    set (dss := filter (fun d => opens d (at_ c u)) (map fst (sees (vars c)))) in *.
    set (ds := filter view dss).
    assert (filter view dss = filter view (map fst (sees (vars c)))) as F.
    { apply filter_and. intros d _ V. destruct (P d V) as (b & B & Fr). unfold opens.
      rewrite <- (beside_neighbour d (at_ c u) b Z B), B, Fr. reflexivity. }
    rewrite forallb_forall in K. specialize (K ds).
    assert (In ds (filter (fun ds => Nat.leb (length ds) (crowd c)) (sets dss))) as M.
    { apply filter_In. split; [apply sets_in |]. apply Nat.leb_le. unfold ds.
      rewrite F, filter_map_length. auto. }
    specialize (K M). cbv zeta in K. rewrite forallb_forall in K.
    assert (In v still) as S by (apply filter_In; auto). specialize (K v S).
    apply existsb_exists in K as (v' & I' & L). apply filter_In in I' as (I' & Sh).
    exists v'. split; [exists vs; auto | split; auto].
    unfold shows in *. rewrite forallb_forall in *. intros (d, y) J. specialize (Sh (d, y) J).
    cbn in *. rewrite <- Sh. f_equal.
    assert (member ds d = view d) as ->; [| reflexivity].
    apply eq_true_iff_eq. rewrite member_ok. unfold ds. rewrite F, filter_In. split; [tauto |].
    intros V. split; auto. change d with (fst (d, y)). apply in_map; auto.
Qed.

(** * The actual view is possible *)

Lemma neighbours_apart a x y d e : beside w d a x = true -> beside w e a y = true ->
  x = y \/ near w x y -> d = e.
Proof.
  unfold near. intros A B [-> | (f & C)].
  - unfold beside in *. destruct d, e; auto; exfalso;
      apply andb_true_iff in A as (A & A'), B as (B & B'); apply N.eqb_eq in A, A', B, B'; lia.
  - unfold beside in *. destruct d, e, f; auto; exfalso;
      apply andb_true_iff in A as (A & A'), B as (B & B'), C as (C & C');
      apply N.eqb_eq in A, A', B, B', C, C'; lia.
Qed.

Variables (pairs : list (nat * nat)) (starts : list N) (team : list controller).
Hypothesis checked : check_team w pairs starts team = true.

(** The sides of a region on which some robots are, or to which they are in transit. *)
Definition seen (s : moment) (others : list nat) (a : N) (d : side) : bool :=
  existsb (fun r => existsb (beside w d a) (holds s r)) others.

Lemma once_at_most ds (f : side -> bool) : once ds = true ->
  (forall d e, f d = true -> f e = true -> d = e) -> (length (filter f ds) <= 1)%nat.
Proof.
  intros O H. induction ds as [| d ds IH]; [cbn; lia |]. cbn in O |- *.
  destruct (member ds d) eqn:M; [discriminate |]. destruct (f d) eqn:F; [| auto]. cbn.
  assert (filter f ds = []) as ->; [| cbn; lia].
  destruct (filter f ds) as [| e es] eqn:E; [auto |].
  assert (In e (filter f ds)) as I by (rewrite E; left; auto). apply filter_In in I as (I & G).
  rewrite (H d e F G) in M. apply member_ok in I. congruence.
Qed.

Lemma filter_or {A} (f g : A -> bool) l :
  (length (filter (fun a => f a || g a) l) <= length (filter f l) + length (filter g l))%nat.
Proof. induction l as [| a l IH]; [cbn; lia |]. cbn. destruct (f a), (g a); cbn; lia. Qed.

Theorem seen_possible s c u others : reached w pairs starts team s -> check_views c = true ->
  (length others <= crowd c)%nat -> possible c (at_ c u) (seen s others (at_ c u)).
Proof.
  intros R K L. pose proof (reached_in_order w pairs starts team checked s R) as (_ & Fr & Co & _).
  split.
  - intros d V. apply existsb_exists in V as (r & _ & V). apply existsb_exists in V as (x & X & B).
    exists x. split; [auto | apply (Fr r x X)].
  - refine (Nat.le_trans _ _ _ _ L). clear L. unfold check_views in K.
    rewrite !andb_true_iff in K. destruct K as ((_ & O) & _).
    rewrite <- (filter_map_length (seen s others (at_ c u)) fst).
    induction others as [| r others IH].
    + assert (forall l, filter (seen s [] (at_ c u)) l = []) as ->; [| cbn; lia].
      intros l. induction l; auto.
    + change (seen s (r :: others) (at_ c u)) with
        (fun d => existsb (beside w d (at_ c u)) (holds s r) || seen s others (at_ c u) d).
      refine (Nat.le_trans _ _ _ (filter_or _ _ _) _). cbn [length].
      assert (length (filter (fun d => existsb (beside w d (at_ c u)) (holds s r))
                (map fst (sees (vars c)))) <= 1)%nat as One; [| lia].
      apply once_at_most; auto. intros d e D E.
      apply existsb_exists in D as (x & X & D). apply existsb_exists in E as (y & Y & E).
      exact (neighbours_apart (at_ c u) x y d e D E (Co r x y X Y)).
Qed.

(** In every reachable state, the strategy of a robot at rest has a successor for its view of the
    others. *)
Theorem never_stuck s q c u others : reached w pairs starts team s -> check_views c = true ->
  post s q = Some (c, u) -> (length others <= crowd c)%nat ->
  exists v, edge (nodes c) u v /\ shows (vars c) v (seen s others (at_ c u)) = true.
Proof.
  intros R K P L. pose proof (reached_in_order w pairs starts team checked s R) as (_ & _ & _ & Po).
  destruct (Po q c u P) as (_ & _ & _ & U). destruct (views_answered c u K U) as ((v & D & Q) & A).
  destruct (A v _ D Q (seen_possible s c u others R K L)) as (v' & D' & S & _). exists v'; auto.
Qed.
End Views.
