(** A play exists: from every node of the strategy, the environment can keep its rules forever and
    meet each assumption infinitely often. So the theorems about a strategy are not vacuous, and the
    strategy does not win by forcing the environment to break its rules. *)
From Coq Require Import List NArith PArith Arith Bool Lia FMapPositive.
From Proved Require Import Gr1 Simplify Ranks Strategy.
Import ListNotations.

(** What must happen infinitely often; anything at all if nothing is assumed. *)
Definition aims (sp : spec) : list form := match env_live sp with [] => [T] | l => l end.

(** An edge that meets aim [j], or comes nearer to such an edge. *)
Definition nears (sp : spec) (j : nat) (u v : node) : bool :=
  if sat (state_of u) (state_of v) (nth j (aims sp) T) then true
  else N.ltb (nth j (ahead v) 0%N) (nth j (ahead u) 0%N).

Definition alive (sp : spec) (g : graph) : bool :=
  forallb (fun u => match look g (next u) with
    | Some vs => forallb (fun j => existsb (nears sp j u) vs) (seq 0 (length (aims sp)))
    | None => false
    end) (all_of g).

Section Alive.
Variables (sp : spec) (g : graph).
Hypothesis checked : check sp g = true.
Hypothesis lives : alive sp g = true.
Let n := length (aims sp).

Lemma aims_some : n <> 0.
Proof. unfold n, aims. destruct (env_live sp); discriminate. Qed.

(** The environment pursues one aim after the other. *)
Definition pick (u : node) (j : nat) : node :=
  match look g (next u) with
  | Some vs => match find (nears sp j u) vs with Some v => v | None => u end
  | None => u
  end.
Definition turn (u v : node) (j : nat) : nat :=
  if sat (state_of u) (state_of v) (nth j (aims sp) T) then S j mod n else j.

Lemma pick_ok u j : In u (all_of g) -> j < n -> edge g u (pick u j) /\ nears sp j u (pick u j) = true.
Proof.
  intros I J. unfold alive in lives. rewrite forallb_forall in lives.
  pose proof (lives u I) as A. unfold pick, edge.
  destruct (look g (next u)) as [vs |]; [| discriminate].
  rewrite forallb_forall in A. specialize (A j). rewrite in_seq in A.
  specialize (A ltac:(fold n; lia)).
  destruct (find (nears sp j u) vs) as [v |] eqn:F.
  - apply find_some in F as (V & N'). split; [exists vs; auto | auto].
  - apply existsb_exists in A as (v & V & N'). eapply find_none in F; eauto. congruence.
Qed.

Section Walk.
Variable first : node.
Hypothesis first_in : In first (beginning sp g).
Hypothesis first_found : find (told sp (state_of first)) (beginning sp g) = Some first.

Fixpoint walk (k : nat) : node * nat :=
  match k with
  | O => (first, 0)
  | S k => let (u, j) := walk k in (pick u j, turn u (pick u j) j)
  end.
Let at_ (k : nat) := fst (walk k).
Let turn_at (k : nat) := snd (walk k).

Lemma walk_ok k : In (at_ k) (all_of g) /\ turn_at k < n.
Proof.
  unfold at_, turn_at. pose proof aims_some as Z. induction k as [| k (I & J)].
  - cbn. split; [apply (begins_ok sp g first first_in) | lia].
  - cbn [walk]. destruct (walk k) as (u, j). cbn in *.
    destruct (pick_ok u j I J) as (D & _). split; [apply (edge_ok sp g checked u _ I D) |].
    unfold turn. destruct (sat _ _ _); [apply Nat.mod_upper_bound; auto | auto].
Qed.

Lemma walk_step k : edge g (at_ k) (at_ (S k)) /\ nears sp (turn_at k) (at_ k) (at_ (S k)) = true /\
  turn_at (S k) = turn (at_ k) (at_ (S k)) (turn_at k).
Proof.
  destruct (walk_ok k) as (I & J). unfold at_, turn_at in *. cbn [walk].
  destruct (walk k) as (u, j). cbn in *. destruct (pick_ok u j I J). auto.
Qed.

Definition shown (k : nat) : state := state_of (at_ k).

Lemma shown_within k x : x < inputs sp -> within sp (shown k) x.
Proof.
  intros _. destruct (walk_ok k) as (I & _). destruct (node_parts sp g checked _ I) as (_ & _ & R & _).
  apply in_ranges_ok in R as (_ & R). exact (R x).
Qed.

Lemma same_inputs_intro m : forall r r', m <= length r -> m <= length r' ->
  (forall x, x < m -> get r x = get r' x) -> same_inputs m r r' = true.
Proof.
  induction m as [| m IH]; intros [| a r] [| a' r'] L L' H; cbn in *; auto; try lia.
  rewrite (H 0 ltac:(lia)) at 1. cbn. rewrite N.eqb_refl. apply IH; try lia.
  intros x X. exact (H (S x) ltac:(lia)).
Qed.

(** No two successors of a node have the same inputs. *)
Lemma distinct_find vs v : distinct (inputs sp) (map row vs) = true -> In v vs ->
  (forall w, In w vs -> inputs sp <= length (row w)) -> find (told sp (state_of v)) vs = Some v.
Proof.
  induction vs as [| w vs IH]; intros D I L; [destruct I |]. cbn in D |- *.
  destruct (existsb (same_inputs (inputs sp) (row w)) (map row vs)) eqn:E; [discriminate |].
  destruct I as [<- | I].
  - rewrite (proj2 (told_ok sp (state_of w) w)); auto.
  - destruct (told sp (state_of v) w) eqn:T; [| apply IH; auto; intros; apply L; right; auto].
    exfalso. rewrite <- not_true_iff_false in E. apply E, existsb_exists.
    exists (row v). split; [apply in_map; auto |].
    apply same_inputs_intro; [apply L; left; auto | apply L; right; auto |].
    exact (proj1 (told_ok sp _ w) T).
Qed.

Lemma row_length u : In u (all_of g) -> inputs sp <= length (row u).
Proof.
  intros I. destruct (node_parts sp g checked u I) as (_ & _ & R & _).
  apply in_ranges_ok in R as (E & _). rewrite E. apply (inputs_few sp g checked).
Qed.

Lemma on_walk k : is_at sp g shown k (at_ k).
Proof.
  induction k as [| k IH].
  - apply (is_at_intro sp g checked); auto. apply walk_ok.
  - destruct (walk_step k) as (D & _). destruct (walk_ok k) as (I & _). destruct (walk_ok (S k)) as (I' & _).
    apply (is_at_intro sp g checked); auto. destruct D as (vs & L & J), IH as (N' & _).
    rewrite (node_at_cons sp g shown k _ vs N' L).
    apply distinct_find; auto.
    + pose proof (node_checked sp g checked _ I) as C. unfold check_node in C. rewrite L in C.
      rewrite !andb_true_iff in C. tauto.
    + intros w W. apply row_length. eapply look_in; eauto.
Qed.

Let b := play sp (strategy_of sp g) shown.

Lemma walk_sat k f : sat (b k) (b (S k)) f = sat (state_of (at_ k)) (state_of (at_ (S k))) f.
Proof. apply sat_ext; apply on_walk. Qed.

Lemma walk_env k : env_ok sp b k.
Proof.
  split.
  - rewrite <- (proj1 (proj2 (begins_ok sp g first first_in))).
    apply sats_ext; apply (on_walk 0).
  - intros j _. destruct (walk_step j) as (D & _).
    destruct (edge_ok sp g checked _ _ (proj1 (walk_ok j)) D) as (_ & E & _). rewrite <- E.
    apply sats_ext; apply on_walk.
Qed.

Lemma aim_met d : forall k, nth (turn_at k) (ahead (at_ k)) 0%N = d ->
  exists k', k <= k' /\ sat (b k') (b (S k')) (nth (turn_at k) (aims sp) T) = true /\
             turn_at (S k') = S (turn_at k) mod n.
Proof.
  induction d as [d IH] using (well_founded_induction N.lt_wf_0). intros k <-.
  destruct (walk_step k) as (_ & P & Q). unfold nears in P. unfold turn in Q.
  destruct (sat (state_of (at_ k)) (state_of (at_ (S k))) (nth (turn_at k) (aims sp) T)) eqn:M.
  - exists k. rewrite walk_sat. auto.
  - apply N.ltb_lt in P. rewrite <- Q in P at 1.
    destruct (IH _ P (S k) eq_refl) as (k' & K & M' & Q'). rewrite Q in M', Q'.
    exists k'. split; [lia | auto].
Qed.

Lemma turns_come m : forall k, exists k', k <= k' /\ turn_at k' = (turn_at k + m) mod n.
Proof.
  induction m as [| m IH]; intros k.
  - exists k. rewrite Nat.add_0_r, Nat.mod_small; [auto | apply walk_ok].
  - destruct (IH k) as (k' & K & E). destruct (aim_met _ k' eq_refl) as (k'' & K' & _ & E').
    exists (S k''). split; [lia |]. rewrite E', E, Nat.add_succ_r.
    change (S (?a mod n)) with (1 + a mod n). apply (Nat.add_mod_idemp_r 1). apply aims_some.
Qed.

Lemma walk_again a : In a (env_live sp) -> again b a.
Proof.
  intros I k. assert (In a (aims sp)) as I' by (unfold aims; destruct (env_live sp); auto; destruct I).
  apply In_nth with (d := T) in I' as (j & J & E). fold n in J.
  destruct (walk_ok k) as (_ & K).
  destruct (turns_come (j + (n - turn_at k)) k) as (k' & L & Q).
  replace (turn_at k + (j + (n - turn_at k))) with (j + 1 * n) in Q by lia.
  rewrite Nat.mod_add, Nat.mod_small in Q by (auto; apply aims_some).
  destruct (aim_met _ k' eq_refl) as (k'' & L' & M & _). rewrite Q, E in M.
  exists k''. split; [lia | auto].
Qed.
End Walk.

(** There is a play in which the environment keeps its rules forever and meets each assumption
    infinitely often. *)
Theorem play_exists : exists i,
  (forall k x, x < inputs sp -> within sp (i k) x) /\
  let b := play sp (strategy_of sp g) i in
  (forall k, env_ok sp b k) /\ (forall a, In a (env_live sp) -> again b a).
Proof.
  destruct (beginning sp g) as [| u us] eqn:B.
  { exfalso. pose proof checked as C. unfold check in C. rewrite !andb_true_iff in C.
    destruct C as (_ & C). rewrite B in C. discriminate. }
  assert (In u (beginning sp g)) as U by (rewrite B; left; auto).
  destruct (find (told sp (state_of u)) (beginning sp g)) as [v |] eqn:F.
  2: { exfalso. eapply find_none in F; eauto.
       rewrite (proj2 (told_ok sp (state_of u) u)) in F; auto; discriminate. }
  destruct (find_some _ _ F) as (V & E).
  assert (find (told sp (state_of v)) (beginning sp g) = Some v) as F'.
  { rewrite <- F. pose proof (proj1 (told_ok sp _ _) E) as E'.
    assert (forall w, told sp (state_of v) w = told sp (state_of u) w) as X.
    { intros w. apply eq_true_iff_eq. rewrite !told_ok.
      split; intros H x L; specialize (H x L); specialize (E' x L); congruence. }
    clear - X. induction (beginning sp g) as [| w ws IH]; [auto |]. cbn. rewrite X, IH. auto. }
  exists (shown v). split; [exact (shown_within v V) |].
  split; [exact (walk_env v V F') | exact (walk_again v V F')].
Qed.
End Alive.
