(** Ranks prove that something happens infinitely often. *)
From Coq Require Import List NArith Arith Bool Lia.
From Proved Require Import Gr1.
Import ListNotations.

(** A number, and perhaps the number of an excuse. *)
Definition rank := (N * option nat)%type.

(** [s] to [s'] misses the goal: does the rank fall, or stay with an excuse that is missed? *)
Definition falls (excuses : list form) (s s' : state) (m m' : rank) : bool :=
  if N.ltb (fst m') (fst m) then true
  else if N.eqb (fst m') (fst m) then
    match snd m, snd m' with
    | Some a, Some a' =>
        if Nat.eqb a a' then
          match nth_error excuses a with Some f => negb (sat s s' f) | None => false end
        else false
    | _, _ => false
    end
  else false.

Definition progress (excuses : list form) (goal : form) (s s' : state) (m m' : rank) : bool :=
  if sat s s' goal then true else falls excuses s s' m m'.

Lemma falls_cases excuses s s' m m' : falls excuses s s' m m' = true ->
  (fst m' < fst m)%N \/
  (fst m' = fst m /\ exists a f, snd m = Some a /\ snd m' = Some a /\
                                 nth_error excuses a = Some f /\ sat s s' f = false).
Proof.
  unfold falls. intros H.
  destruct (N.ltb_spec (fst m') (fst m)) as [L | L]; [left; auto |].
  destruct (N.eqb_spec (fst m') (fst m)) as [E | D]; [| discriminate].
  destruct (snd m) as [a |] eqn:A; [| discriminate].
  destruct (snd m') as [a' |] eqn:A'; [| discriminate].
  destruct (Nat.eqb_spec a a') as [<- | D]; [| discriminate].
  destruct (nth_error excuses a) as [f |] eqn:X; [| discriminate].
  right; split; auto. exists a, f. rewrite negb_true_iff in H. auto.
Qed.

Section Measure.
Variable (b : nat -> state) (m : nat -> rank) (excuses : list form) (goal : form).
Hypothesis step : forall k, progress excuses goal (b k) (b (S k)) (m k) (m (S k)) = true.
Hypothesis excused : forall f, In f excuses -> again b f.

Let met k := sat (b k) (b (S k)) goal = true.

(** On the way from [k] the goal is met, or the number falls, or the rank stays as it is. *)
Lemma scan k a : snd (m k) = Some a -> forall d,
  (exists j, k <= j /\ met j) \/
  (exists j, k <= j /\ (fst (m j) < fst (m k))%N) \/
  (fst (m (k + d)) = fst (m k) /\ snd (m (k + d)) = Some a).
Proof.
  intros A d; induction d as [| d [IH | [IH | (E & E')]]]; auto.
  - rewrite Nat.add_0_r. auto.
  - rewrite Nat.add_succ_r. specialize (step (k + d)). unfold progress in step.
    destruct (sat (b (k + d)) (b (S (k + d))) goal) eqn:M.
    + left; exists (k + d); split; [lia | exact M].
    + apply falls_cases in step as [L | (Q & a' & f & A' & A'' & _)].
      * right; left; exists (S (k + d)); split; [lia |]. rewrite <- E; auto.
      * right; right; split; [congruence |]. rewrite A'' , <- A', E'. reflexivity.
Qed.

Lemma measured : again b goal.
Proof.
  intros k0.
  enough (forall n k, fst (m k) = n -> exists j, k <= j /\ met j) as H by exact (H _ k0 eq_refl).
  clear k0. intros n; induction n as [n IH] using (well_founded_induction N.lt_wf_0).
  intros k <-. pose proof (step k) as St. unfold progress in St.
  destruct (sat (b k) (b (S k)) goal) eqn:M; [exists k; split; [lia | exact M] |].
  apply falls_cases in St as [L | (Q & a & f & A & A' & X & _)].
  - destruct (IH _ L (S k) eq_refl) as (j & J & G). exists j; split; [lia | auto].
  - destruct (excused f (nth_error_In _ _ X) k) as (j & J & G).
    destruct (scan k a A (j - k)) as [H | [(i & I & L) | (E & E')]]; auto.
    + destruct (IH _ L i eq_refl) as (i' & I' & G'). exists i'; split; [lia | auto].
    + replace (k + (j - k)) with j in * by lia.
      pose proof (step j) as St. unfold progress in St.
      destruct (sat (b j) (b (S j)) goal) eqn:M'; [exists j; split; [lia | exact M'] |].
      apply falls_cases in St as [L | (Q' & a' & f' & B & B' & X' & S')].
      * rewrite E in L. destruct (IH _ L (S j) eq_refl) as (i & I & G').
        exists i; split; [lia | auto].
      * rewrite E' in B; injection B as <-. rewrite X in X'; injection X' as <-.
        rewrite G in S'; discriminate.
Qed.
End Measure.
