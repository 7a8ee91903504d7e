(* safenav-proved SPECIFICATION AUTOMATON MEASURES: whether a theorem holds of these files. Trusted: that
   "proved" is printed only if the extracted function accepts the bytes of the specification; each
   theorem is in theories/Certificates.v. *)
open Proved
open Certificate

let first_bad listed bad = match List.find_opt bad listed with
  | Some u -> Printf.sprintf "node %d" u.number
  | None -> "the initial inputs"

(* What is proved, or the place of the error. *)
let judged specification automaton measures =
  let text = text specification and document = json automaton and measures = json measures in
  match Json.str (Json.field "of" measures) with
  | "strategy" ->
      let s = strategy text document measures in
      if establish text.bytes s.graph then Ok "the strategy realizes the specification"  (* establish_sound *)
      else
        let node u = Option.get (PositiveMap.find (name u.number) s.graph) in
        Error (first_bad s.listed (fun u -> not (check_node text.meaning s.graph (node u))))
  | "counterstrategy" ->
      let c = counterstrategy text document measures in
      if refute text.bytes c.cgraph c.start then Ok "no strategy realizes the specification"  (* refute_sound *)
      else Error (first_bad c.members (fun u -> not (check_cnode text.meaning c.cgraph (c.build u))))
  | other -> raise (Json.Bad ("measures of a " ^ other))

let () = match Sys.argv with
  | [| _; specification; automaton; measures |] ->
    let verdict = try judged specification automaton measures with
      | Json.Bad why -> Error why
      | Not_found | Invalid_argument _ | Failure _ -> Error "a file is not as documented"
      | Sys_error why -> prerr_endline ("safenav-proved: " ^ why); exit 2 in
    (match verdict with
     | Ok what -> print_endline ("proved: " ^ what)
     | Error where -> print_endline ("refused: " ^ where); exit 1)
  | _ -> prerr_endline "usage: safenav-proved SPECIFICATION AUTOMATON MEASURES"; exit 2
