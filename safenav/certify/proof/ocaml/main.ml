(* safenav-proved BUNDLE: what of a bundle is proved, as JSON. Trusted: that what is asked of the
   extracted functions is what is printed; each theorem is in theories/Files.v. *)
open Proved
open Bundle

type verdict = Proved | Refused of string | Open of string  (* Open: not covered, why *)
type answer = { kind : string; about : (string * string) list; verdict : verdict }

let answers = ref []
let tell kind about verdict = answers := { kind; about; verdict } :: !answers
let attempt f = try f () with
  | Json.Bad why -> Refused why
  | Not_covered why -> Open why
  | Not_found | Invalid_argument _ | Failure _ | Sys_error _ -> Refused "a file is not as documented"
let proved_if ok why = if ok then Proved else Refused (why ())

let first_bad listed bad otherwise = match List.find_opt bad listed with
  | Some u -> Printf.sprintf "node %d" u.number
  | None -> otherwise
let the_node g u = Option.get (PositiveMap.find (name u.number) g)

(* establish_sound, alive_sound: of each specification and strategy, once. *)
let judged : (string * string, listed list * established option) Hashtbl.t = Hashtbl.create 20
let realizes b spec graph =
  let about = ["spec", spec; "strategy", graph] in
  let found = ref None and listed = ref [] in
  tell "realizes" about (attempt (fun () ->
    let s = strategy b spec graph in
    listed := s.listed;
    found := establish s.of_text.bytes s.graph;
    proved_if (!found <> None) (fun () ->
      let sp = s.of_text.meaning in
      let fine = arrivals sp s.graph in
      first_bad s.listed (fun u -> not (check_node sp s.graph fine (the_node s.graph u)))
        "the inputs at first")));
  Option.iter (fun e -> tell "alive" about (if is_alive e then Proved
    else Open "from some node the environment cannot go on to meet its assumptions")) !found;
  Hashtbl.replace judged (spec, graph) (!listed, !found)

(* refute_sound *)
let unrealizable b spec =
  tell "unrealizable" ["spec", spec] (attempt (fun () ->
    let text, listed, build, start = counterstrategy b spec in
    let g = made build listed in
    proved_if (refute text.bytes g start) (fun () ->
      first_bad listed (fun u -> not (check_cnode text.meaning g (build u))) "the inputs at first")))

let the_strategy line = match Json.field_opt "strategy" line, Json.field_opt "node" line with
  | Some (Json.Str graph), Some (Json.Num _) ->
      Hashtbl.find_opt judged (Json.str (Json.field "spec" line), graph)
  | _ -> None

(* moves_sound *)
let keeps world robots (number, line) =
  match the_strategy line with
  | None -> ()
  | Some (listed, e) ->
    tell (if targets line = [] then "moves" else "visits") ["line", string_of_int number] (attempt (fun () ->
      match e with
      | None -> Refused "its strategy is not shown to realize its specification"
      | Some e ->
        let robot = List.find (fun r -> r.name = Json.str (Json.field "robot" line)) robots in
        let c, _ = circumstances robot line in
        proved_if (moves e world c (targets line)) (fun () -> match places_of e.names c with
          | None -> "the variables are not those of its circumstances"
          | Some p ->
            let g = e.strategy_graph in
            first_bad listed (fun u -> not (keeps_node world c p g (the_node g u)))
              "a target is not visited")))

(* team_sound, answers_sound *)
let team world robots lines =
  let member (number, line) =
    let robot = List.find (fun r -> r.name = Json.str (Json.field "robot" line)) robots in
    match Json.field_opt "verdict" line, the_strategy line with
    | Some (Json.Str "realizable"), Some (_, Some e) ->
        let c, crowd = circumstances robot line in
        [(number, robot), (((e, nat robot.index), c), nat crowd)]
    | Some (Json.Str "realizable"), Some (_, None) ->
        raise (Json.Bad (Printf.sprintf "the strategy of line %d is not shown to realize its specification" number))
    | Some (Json.Str "realizable"), None when Json.field_opt "node" line <> None ->
        raise (Not_covered (Printf.sprintf "line %d: %s gets its moves on demand" number robot.name))
    | _ -> [] in
  let all = lazy (List.concat_map member lines) in
  let pairs = pairs robots and starts = starts robots in
  let meets r = List.exists (fun (a, b) -> a = nat r.index || b = nat r.index) pairs in
  let told f = match List.find_opt (fun (_, m) -> not (f m)) (Lazy.force all) with
    | Some ((number, robot), _) -> Some (Printf.sprintf "line %d: %s" number robot.name, robot)
    | None -> None in
  let single check m = match controller_of m with Some c -> check c | None -> false in
  let safe = ref false in
  tell "apart" [] (attempt (fun () ->
    let ms = List.map snd (Lazy.force all) in
    safe := apart world pairs starts ms;
    if !safe then Proved else match told (single (check_controller world pairs)) with
      | Some (where, robot) when meets robot && Json.str (Json.field "tracking" robot.data) <> "nearby" ->
          Open (where ^ " knows positions of others; covered are robots that see who is beside them")
      | Some (where, _) -> Refused (where ^ " moves where it must not, or where it does not look")
      | None -> Refused "two robots that must not meet start in one region, or one in a wall"));
  if !safe then tell "answers" [] (attempt (fun () ->
    let ms = List.map snd (Lazy.force all) in
    if answering world pairs starts ms then Proved else match told (single (check_views world)) with
      | Some (where, _) -> Refused (where ^ " has no answer to something that it can observe of others")
      | None -> Refused "the strategies"))

let files dir = if has dir then List.sort compare (Array.to_list (Sys.readdir dir)) else []
let quoted s = "\"" ^ String.concat "" (List.map (function
  | '"' -> "\\\"" | '\\' -> "\\\\" | c when Char.code c < 32 -> Printf.sprintf "\\u%04x" (Char.code c)
  | c -> String.make 1 c) (List.of_seq (String.to_seq s))) ^ "\""
let print { kind; about; verdict } =
  let verdict, reason = match verdict with
    | Proved -> "proved", "" | Refused why -> "refused", why | Open why -> "not covered", why in
  let all = (("kind", kind) :: about) @ ["verdict", verdict; "reason", reason] in
  "{" ^ String.concat ", " (List.map (fun (k, v) -> quoted k ^ ": " ^ quoted v) all) ^ "}"

let () = match Sys.argv with
  | [| _; b |] when has (b / "scenario.json") || has (b / "specs") ->
    List.iter (fun m -> match String.split_on_char '-' (Filename.remove_extension m) with
      | [spec; graph] -> realizes b spec graph
      | _ -> ()) (files (b / "measures"));
    List.iter (fun c -> unrealizable b (Filename.remove_extension c)) (files (b / "counterstrategies"));
    (if has (b / "scenario.json") then try
      let scenario = json (b / "scenario.json") in
      let world = world scenario and robots = robots scenario and lines = syntheses b in
      List.iter (keeps world robots) lines;
      team world robots lines
    with Json.Bad why -> tell "apart" [] (Refused why));
    print_endline ("[" ^ String.concat ",\n " (List.rev_map print !answers) ^ "]");
    let refused = List.exists (fun a -> match a.verdict with Refused _ -> true | _ -> false) !answers in
    exit (if refused then 1 else 0)
  | _ -> prerr_endline "safenav-proved BUNDLE: the folder of a bundle of safenav"; exit 2
